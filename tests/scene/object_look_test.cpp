#include "scene/objects/object_look.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/random.h"
#include "geo/units.h"
#include "scene/light/hit_shader.h"
#include "scene/objects/object_shading.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"

namespace terracast::scene {
namespace {

using world::FacadeStyle;
using world::Material;

Sky noon() {
  const double elevation = geo::radians_from_degrees(50.0);
  return Sky({.sun_direction_world = {std::cos(elevation), 0.0, std::sin(elevation)},
              .up_world = Eigen::Vector3d::UnitZ(),
              .visibility_m = 60e3});
}

double uniform(std::uint64_t stream, std::uint64_t index) {
  return static_cast<double>(core::random_bits(5, stream, index) >> 11) * 0x1.0p-53;
}

/// A place on a wall that faces south, without noise.
ObjectPlace wall_place(Material material, std::uint16_t pattern, double u_m, double v_m,
                       double footprint_m, std::uint64_t object = 1) {
  ObjectPlace place{};
  place.finish = {.material = material, .color_srgb = {200, 160, 120}, .pattern = pattern};
  place.color = {0.58f, 0.35f, 0.19f};
  place.seed = core::mix_bits(object);
  place.has_uv = true;
  place.u_m = u_m;
  place.v_m = v_m;
  place.u = Eigen::Vector3f::UnitX();
  place.v = Eigen::Vector3f::UnitZ();
  place.normal = -Eigen::Vector3f::UnitY();
  place.from_place_m = {static_cast<float>(u_m), 0.0f, static_cast<float>(v_m)};
  place.footprint_m = static_cast<float>(footprint_m);
  return place;
}

std::uint16_t any_pattern(Material material, std::uint64_t i) {
  return material <= Material::SheetMetal && i % 3 != 0
             ? world::facade_pattern(static_cast<std::uint8_t>(i % 9),
                                     static_cast<std::uint8_t>(24 + i % 40))
             : std::uint16_t{0};
}

/// A place anywhere on anything of a material, with noise.
ObjectPlace any_place(Material material, std::uint64_t i) {
  const double footprint_m = std::exp(std::log(1e-3) + uniform(1, i) * std::log(1e5));
  ObjectPlace place = wall_place(material, any_pattern(material, i), 60.0 * uniform(2, i),
                                 20.0 * uniform(3, i) - 2.0, footprint_m, i % 7);
  place.color = {static_cast<float>(uniform(4, i)), static_cast<float>(uniform(5, i)),
                 static_cast<float>(uniform(6, i))};
  place.variety = static_cast<std::uint8_t>(i);
  place.part = static_cast<std::uint32_t>(i % 50);
  place.coarse = static_cast<float>(4.0 * uniform(7, i) - 2.0);
  place.fine = static_cast<float>(4.0 * uniform(8, i) - 2.0);
  place.reach_m = i % 2 == 0 ? 0.0f : 3.0f;
  place.height_m = i % 2 == 0 ? 0.0f : 9.0f;
  return place;
}

std::array<float, 3> channels(const Rgb& color) { return {color.r, color.g, color.b}; }

// In a white furnace, where the same light comes from everywhere, a surface that sends back more than
// comes to it would be brighter than the furnace.
TEST(ObjectLooks, NoMaterialSendsBackMoreThanItGets) {
  for (int material = 0; material < world::kNumMaterials; ++material) {
    for (std::uint64_t i = 0; i < 3000; ++i) {
      const ObjectLook look = look_at_object(any_place(static_cast<Material>(material), i));
      const auto albedo = channels(look.albedo);
      const auto through = channels(look.transmitted);
      const auto facing = channels(look.gloss.facing);
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_GE(albedo[k], 0.0f) << material;
        ASSERT_GE(through[k], 0.0f) << material;
        for (const float cosine : {0.0f, 0.1f, 0.5f, 1.0f}) {
          const float mirrored = look.gloss.share * mirrored_share(facing[k], cosine);
          ASSERT_GE(mirrored, 0.0f) << material;
          // Floats of a few operations on numbers of [0, 1].
          ASSERT_LE(mirrored + (1.0f - mirrored) * (albedo[k] + through[k]), 1.0f + 1e-6f)
              << material << " at " << i;
        }
      }
      ASSERT_NEAR(look.normal.norm(), 1.0f, 1e-5f) << material;
      ASSERT_NEAR(look.gloss.normal.norm(), 1.0f, 1e-5f) << material;
      ASSERT_GE(look.openness, 0.0f);
      ASSERT_LE(look.openness, 1.0f);
      ASSERT_GE(look.crown_openness, 0.0f);
      ASSERT_LE(look.crown_openness, 1.0f);
    }
  }
}

// The sun's light that a surface sends into the half space above it, by an integral over directions,
// against what comes down on it.
TEST(ObjectLooks, SunlightThatLeavesIsLessThanWhatComes) {
  const Sky sky = noon();
  const float cos_sun = static_cast<float>(sky.daylight().sun_direction_world.z());
  for (int material = 0; material < world::kNumMaterials; ++material) {
    ObjectLook look = look_at_object(any_place(static_cast<Material>(material), 1));
    look.normal = look.gloss.normal = Eigen::Vector3f::UnitZ();
    constexpr int kRings = 160;
    constexpr int kSectors = 320;
    double leaving = 0.0;
    for (int ring = 0; ring < kRings; ++ring) {
      const double cosine = std::sqrt((ring + 0.5) / kRings);  // rings of equal projected area
      const double sine = std::sqrt(1.0 - cosine * cosine);
      for (int sector = 0; sector < kSectors; ++sector) {
        const double turn = 2.0 * std::numbers::pi * (sector + 0.5) / kSectors;
        const Eigen::Vector3f out(static_cast<float>(sine * std::cos(turn)),
                                  static_cast<float>(sine * std::sin(turn)),
                                  static_cast<float>(cosine));
        const Color with = object_radiance(look, {out, 1.0f, 1.0f}, sky);
        const Color without = object_radiance(look, {out, 0.0f, 1.0f}, sky);
        leaving +=
            static_cast<double>((with - without)[1]) * std::numbers::pi / (kRings * kSectors);
      }
    }
    const double coming = static_cast<double>(sky.sun_irradiance()[1] * cos_sun);
    // The narrowest lobe, of roughness 0.03, is 4 cells wide: its integral errs by under 2 %.
    EXPECT_LE(leaving, 1.02 * coming) << material;
    EXPECT_GT(leaving, 0.0) << material;
  }
}

struct MeanLook {
  std::array<double, 3> albedo{};
  double gloss = 0.0;
};

MeanLook mean_of_fine_looks(Material material, std::uint16_t pattern, double width_m,
                            double height_m) {
  constexpr int kColumns = 420;
  constexpr int kRows = 240;
  MeanLook mean;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const auto i = static_cast<std::uint64_t>(row * kColumns + column);
      const double u_m = width_m * (column + uniform(11, i)) / kColumns;
      const double v_m = height_m * (row + uniform(12, i)) / kRows;
      const ObjectLook look = look_at_object(wall_place(material, pattern, u_m, v_m, 2e-3));
      const auto albedo = channels(look.albedo);
      for (std::size_t k = 0; k < 3; ++k)
        mean.albedo[k] += static_cast<double>(albedo[k]) / (kColumns * kRows);
      mean.gloss += static_cast<double>(look.gloss.share) / (kColumns * kRows);
    }
  }
  return mean;
}

/// The look from so far that one sample covers it all is the mean of looks from near by.
/// share   of the albedo by which they may differ
void expect_mean(Material material, std::uint16_t pattern, double width_m, double height_m,
                 double share, const std::string& what) {
  const MeanLook mean = mean_of_fine_looks(material, pattern, width_m, height_m);
  const ObjectLook far =
      look_at_object(wall_place(material, pattern, 0.5 * width_m, 0.5 * height_m, height_m));
  const auto albedo = channels(far.albedo);
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(static_cast<double>(albedo[k]), mean.albedo[k], share * mean.albedo[k]) << what;
  EXPECT_NEAR(static_cast<double>(far.gloss.share), mean.gloss, 0.03) << what;
}

// Tints of some ten thousand bricks, tiles or boards average out to 1 %; a few hundred panels and sheets to
// 2 %; 100 000 places find the share of joints to 1 %.
TEST(ObjectLooks, FromFarAPatternIsItsMean) {
  for (const Material material :
       {Material::Plaster, Material::Brick, Material::StoneWall, Material::ConcreteWall,
        Material::WoodWall, Material::SheetMetal, Material::RoofTiles, Material::Slate,
        Material::FlatRoof, Material::MetalRoof, Material::Thatch, Material::Bark,
        Material::Concrete, Material::Planks})
    expect_mean(material, 0, 150.0, 60.0, 0.03, std::to_string(static_cast<int>(material)));
}

/// Mean albedo of a roof over its places, from near by.
std::array<double, 3> roof_albedo(Material material, std::uint64_t object,
                                  const Eigen::Vector3f& normal = Eigen::Vector3f::UnitZ()) {
  std::array<double, 3> mean{};
  constexpr int kPlaces = 400;
  for (std::uint64_t i = 0; i < kPlaces; ++i) {
    ObjectPlace place = wall_place(material, 0, 30.0 * uniform(51, i), 12.0 * uniform(52, i), 0.02);
    place.seed = core::mix_bits(object);
    place.normal = normal;
    const auto albedo = channels(look_at_object(place).albedo);
    for (std::size_t k = 0; k < 3; ++k) mean[k] += static_cast<double>(albedo[k]) / kPlaces;
  }
  return mean;
}

// Clay differs from house to house in tint and age, as the house's own number says; all houses together have
// the finish's albedo behind what lies on it.
TEST(ObjectLooks, RoofsOfClayDifferFromHouseToHouse) {
  constexpr std::uint64_t kHouses = 400;
  std::array<double, 3> mean{};
  double mean_tint = 0.0, squares = 0.0;
  for (std::uint64_t house = 0; house < kHouses; ++house) {
    const auto albedo = roof_albedo(Material::RoofTiles, house);
    for (std::size_t k = 0; k < 3; ++k) mean[k] += albedo[k] / kHouses;
    const double tint = std::log(albedo[2] / albedo[0]);
    mean_tint += tint / kHouses;
    squares += tint * tint / kHouses;
  }
  // A sum of two numbers of [0, 1) varies by the root of 1/6: by it blue over red turns by 0.39, less what grime
  // covers; age adds to it.
  const double spread = std::sqrt(squares - mean_tint * mean_tint);
  EXPECT_GT(spread, 0.08);
  EXPECT_LT(spread, 0.30);
  // Butts of 0.16 of a row take 0.45, joints of 8 in 220 mm take 0.35; then grime on 0.12 + 0.56 / 3, new tiles
  // on 0.30 / 2 / 16, moss on 0.55 of the mean of what age is above 0.75. A quarter of the colour is gone
  // before.
  const double bare = (1.0 - 0.45 * 0.16) * (1.0 - 0.35 * 0.008 / 0.22);
  const std::array<double, 3> finish = {0.58, 0.35, 0.19}, grime = {0.142, 0.121, 0.100},
                              mended = {0.340, 0.150, 0.085}, moss = {0.090, 0.095, 0.055};
  const double grey = 0.3 * finish[0] + 0.6 * finish[1] + 0.1 * finish[2];
  const auto laid = [](double under, double share, double over) {
    return under + share * (over - under);
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const double bleached = bare * laid(finish[k], 0.26, grey);
    const double expected =
        laid(laid(laid(bleached, 0.12 + 0.56 / 3.0, grime[k]), 0.30 / 2.0 / 16.0, mended[k]),
             0.55 * 0.25 * 0.25 / 2.0, moss[k]);
    // Brightness of houses varies by 0.115, which 400 average out to 0.6 %; 3 of those, and as much for places.
    EXPECT_NEAR(mean[k], expected, 0.03 * expected) << k;
  }
}

// Moss and soot stay where the sun does not dry them.
TEST(ObjectLooks, RoofsToTheNorthAreDarker) {
  const Eigen::Vector3f north = Eigen::Vector3f(0.0f, 0.4f, 0.9f).normalized();
  const Eigen::Vector3f south = Eigen::Vector3f(0.0f, -0.4f, 0.9f).normalized();
  for (std::uint64_t house = 0; house < 50; ++house)
    EXPECT_LT(roof_albedo(Material::RoofTiles, house, north)[0],
              roof_albedo(Material::RoofTiles, house, south)[0]);
}

// Facades hold few cells in a house, and each building's bays are its own: of 300 bays in 20 storeys one
// kind or another comes by up to a tenth more often than in the mean of all.
TEST(ObjectLooks, FromFarAFacadeIsItsMean) {
  for (int style = 0; style < 9; ++style) {
    const bool is_tall = style == static_cast<int>(FacadeStyle::Hall) ||
                         style == static_cast<int>(FacadeStyle::Church);
    const int storey_dm = is_tall ? 70 : 30;
    expect_mean(Material::Plaster,
                world::facade_pattern(static_cast<std::uint8_t>(style),
                                      static_cast<std::uint8_t>(storey_dm)),
                900.0, 20 * 0.1 * storey_dm, 0.07, "style " + std::to_string(style));
  }
  expect_mean(Material::GlassFacade, 0, 300.0, 68.0, 0.07, "glass");
}

// Between near and far nothing jumps: the mean over a wall stays what it is at every footprint.
TEST(ObjectLooks, AFacadeKeepsItsMeanWhileItFades) {
  const std::uint16_t pattern = world::facade_pattern(FacadeStyle::House, 30);
  const auto mean_at = [&](double footprint_m) {
    double sum = 0.0;
    for (std::uint64_t i = 0; i < 40000; ++i)
      sum += static_cast<double>(
          look_at_object(wall_place(Material::Plaster, pattern, 600.0 * uniform(21, i),
                                    3.0 + 27.0 * uniform(22, i), footprint_m))
              .albedo.g);
    return sum / 40000.0;
  };
  const double near = mean_at(0.002);
  // 200 places a bay of 200 find its windows to 1 %; windows of unlike cells side by side are taken for
  // alike where a footprint covers both, which costs 3 %.
  for (const double footprint_m : {0.05, 0.3, 1.0, 1.8, 3.0})
    EXPECT_NEAR(mean_at(footprint_m), near, 0.05 * near) << footprint_m;
}

TEST(ObjectLooks, WindowsStandAboveTheFootAndInsideTheWall) {
  const std::uint16_t pattern = world::facade_pattern(FacadeStyle::House, 30);
  double glass = 0.0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const double u_m = 40.0 * uniform(31, i);
    EXPECT_EQ(
        look_at_object(wall_place(Material::Plaster, pattern, u_m, -0.5 - uniform(32, i), 0.01))
            .gloss.share,
        0.0f);
    EXPECT_EQ(look_at_object(wall_place(Material::Plaster, 0, u_m, 9.0 * uniform(33, i), 0.01))
                  .gloss.share,
              0.0f);
    glass += static_cast<double>(look_at_object(wall_place(Material::Plaster, pattern, u_m,
                                                           3.0 + 6.0 * uniform(34, i), 0.01))
                                     .gloss.share);
  }
  // A window of 0.36 bays by 0.47 storeys, less its frame, in 5 bays of 6.
  EXPECT_GT(glass / 2000.0, 0.05);
  EXPECT_LT(glass / 2000.0, 0.20);
}

/// Rays down on ground and objects side by side.
struct Hits {
  std::vector<world::WorldRay> rays;
  std::vector<world::SurfaceHit> hits;
  std::vector<world::SurfaceSample> surfaces;
  std::vector<float> sun_share;
  std::vector<float> sky_share;

  explicit Hits(std::size_t count) : hits(count), surfaces(count) {
    for (std::size_t i = 0; i < count; ++i) {
      const double x = 3.0 * uniform(41, i);
      rays.push_back({.origin_world = {0.0, 0.0, 900.0},
                      .direction_world = Eigen::Vector3d(x, 0.4, -1.0).normalized()});
      if (i % 7 == 3) continue;  // sky
      hits[i].t = 500.0 + 100.0 * uniform(42, i);
      surfaces[i].spacing_m = 1.0;
      surfaces[i].moisture = 0.5;
      if (i % 3 != 0) {
        hits[i].object = static_cast<std::uint32_t>(i);
        hits[i].triangle = static_cast<std::uint32_t>(i % 11);
        hits[i].object_normal_world = Eigen::Vector3d(0.1, -0.6, 0.5).normalized();
        const auto material = static_cast<Material>(i % world::kNumMaterials);
        surfaces[i].finish = {.material = material, .pattern = any_pattern(material, i)};
        surfaces[i].provenance.instance_id = static_cast<std::uint32_t>(i + 1);
        surfaces[i].uv = {static_cast<float>(9.0 * x), 4.0f};
        surfaces[i].from_place_m = {1.0f, 2.0f, static_cast<float>(x)};
        surfaces[i].variety = static_cast<std::uint8_t>(31 * i);
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      sun_share.push_back(i % 2 == 0 ? 1.0f : 0.0f);
      sky_share.push_back(i % 5 == 0 ? -1.0f : static_cast<float>(uniform(43, i)));
    }
  }
  LitHits lit(std::size_t first, std::size_t count) const {
    const auto part = [&](const auto& all) { return std::span(all).subspan(first, count); };
    return {.rays = part(rays),
            .hits = part(hits),
            .surfaces = part(surfaces),
            .sun_share = part(sun_share),
            .sky_share = part(sky_share),
            .sample_width = {.angle_rad = 1e-3}};
  }
};

// What a ray brings to the camera depends on no other ray: shaded one by one, in pairs or all together.
TEST(ObjectLooks, HitsAreShadedAlikeInAnyCompany) {
  const Sky sky = noon();
  const Ground ground(Climate{});
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_tiny_world(
      folder.path(), [](double, double) { return 0.0; }, {.coarsest_level = 0});
  const GroundImagery imagery(store, 1e6);
  const std::vector<world::Texture> texture = {{"grey", core::Image8(2, 2, 3, std::uint8_t{99})}};
  const TextureLibrary textures(texture);
  const HitShader shader(ground, imagery, textures, sky);
  constexpr std::size_t kCount = 190;
  const Hits hits(kCount);
  HitShader::Scratch scratch;
  std::vector<Color> together(kCount);
  shader.shade(hits.lit(0, kCount), scratch, together);
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{17}}) {
    for (std::size_t first = 0; first + count <= kCount; first += count) {
      std::vector<Color> apart(count);
      shader.shade(hits.lit(first, count), scratch, apart);
      for (std::size_t i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k)
          ASSERT_EQ(apart[i][k], together[first + i][k]) << first + i << " of " << count;
    }
  }
}

// A leaf with the sun behind it glows, with bark between it is dark.
TEST(ObjectLooks, LightGoesThroughLeavesOnly) {
  const Sky sky = noon();
  const Eigen::Vector3f sun = sky.daylight().sun_direction_world.cast<float>();
  for (const Material material : {Material::Leaves, Material::Bark}) {
    ObjectLook look = look_at_object(any_place(material, 2));
    look.gloss.share = 0.0f;
    look.normal = -sun;
    const Color lit = object_radiance(look, {-sun, 1.0f, 1.0f}, sky);
    const Color shaded = object_radiance(look, {-sun, 0.0f, 1.0f}, sky);
    const double gained = static_cast<double>((lit - shaded)[1]);
    const double expected =
        static_cast<double>(look.transmitted.g * sky.sun_irradiance()[1]) / std::numbers::pi;
    EXPECT_NEAR(gained, expected, 1e-4 * static_cast<double>(sky.sun_irradiance()[1]));
    EXPECT_EQ(material == Material::Leaves, gained > 0.0);
  }
}

}  // namespace
}  // namespace terracast::scene
