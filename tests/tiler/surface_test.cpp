#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "core/registry.h"
#include "tests/tiler/raster_files.h"
#include "tiler/detail.h"
#include "tiler/geodesy_cells.h"
#include "tiler/elevation_registry.h"
#include "tiler/tile_builder.h"

namespace terracast::test {
namespace {

using tiler::SurfaceSample;
using world::Cover;
using world::kTileSamples;
using world::Tile;
using world::TileId;

geo::Geodetic place_of(const tiler::WorldSurface& surface, double x, double y) {
  return surface.frame().geodetic_from_world({x, y, surface.sample(x, y).z_world});
}

/// World x and y of a place's foot on the ellipsoid: what analytic terrain is a function of.
Eigen::Vector2d foot(const tiler::WorldSurface& surface, const geo::Geodetic& place) {
  return surface.frame().world_from_geodetic({place.lat_deg, place.lon_deg, 0.0}).head<2>();
}

TEST(Analytic, HeightsAreThoseOfTheClosedForms) {
  for (const double latitude : {-33.0, 0.0, 42.5, 70.0}) {
    for (const double size_m : {2048.0, 51200.0}) {
      SCOPED_TRACE(fmt::format("{} {}", latitude, size_m));
      tiler::WorldOptions plane = world_of("plane", size_m);
      plane.origin_lat_deg = latitude;
      plane.elevation[0].height_m = 321.5;
      tiler::WorldOptions ramp = plane;
      ramp.elevation[0].kind = "ramp";
      ramp.elevation[0].slope = 0.04;
      tiler::WorldOptions bowl = plane;
      bowl.elevation[0].kind = "paraboloid";
      bowl.elevation[0].curvature_per_m = 1e-6;
      const auto on_plane = prepare(plane);
      const auto on_ramp = prepare(ramp);
      const auto in_bowl = prepare(bowl);
      for (const Eigen::Vector2d& at : scattered_places(size_m)) {
        // 1e-6 m: the promise of the fixed point and of the geodesy between nodes.
        EXPECT_NEAR(place_of(*on_plane, at.x(), at.y()).height_m, 321.5, 1e-6);
        geo::Geodetic place = place_of(*on_ramp, at.x(), at.y());
        EXPECT_NEAR(place.height_m, 321.5 + 0.04 * foot(*on_ramp, place).x(), 1e-6);
        EXPECT_NEAR(on_ramp->measured_height_m(place.lat_deg, place.lon_deg).value(),
                    place.height_m, 1e-6);
        place = place_of(*in_bowl, at.x(), at.y());
        EXPECT_NEAR(place.height_m, 321.5 + 0.5e-6 * foot(*in_bowl, place).squaredNorm(), 1e-6);
      }
    }
  }
}

TEST(Analytic, ShapesThatRiseBeyondWhatAWorldHoldsAreRefused) {
  tiler::WorldOptions options = world_of("ramp", 51200.0);
  options.elevation[0].slope = 1.0;
  expect_error(core::ErrorKind::Config, {"elevation.0", "slope = 1", "size_m = 51200", "8000 m"},
               [&] { options.validate(); });
  options.elevation[0].slope = -0.15;
  EXPECT_NO_THROW(options.validate());
  options.size_m = 2048.0;
  options.elevation[0].slope = 3.0;
  EXPECT_NO_THROW(options.validate());
  options = world_of("paraboloid", 51200.0);
  options.elevation[0].curvature_per_m = -2e-5;
  expect_error(core::ErrorKind::Config, {"curvature_per_m = -2e-05", "13107 m", "size_m"},
               [&] { options.validate(); });
}

/// Map coordinates that jump by `jump_m` along a meridian.
class SeamedField : public tiler::HeightField {
 public:
  SeamedField(const geo::WorldFrame& frame, double jump_m) : frame_(frame), jump_m_(jump_m) {}
  void map_from_geodetic(std::span<const geo::Geodetic> places,
                         std::span<Eigen::Vector2d> map) const override {
    for (std::size_t i = 0; i < places.size(); ++i) {
      map[i] = frame_.world_from_geodetic({places[i].lat_deg, places[i].lon_deg, 0.0}).head<2>();
      if (map[i].x() > 0.0) map[i].x() += jump_m_;
    }
  }
  double height_m(const Eigen::Vector2d&) const override { return 0.0; }
  tiler::FieldFacts facts(const Eigen::Vector2d&) const override { return {}; }
  bool has_sea() const override { return false; }
  double lowest_m() const override { return 0.0; }
  double highest_m() const override { return 0.0; }
  const geo::VerticalDatum& datum() const override { return datum_; }
  double spacing_m() const override { return 1.0; }
  double metres_per_map_unit() const override { return 1.0; }
  bool takes_detail() const override { return false; }
  const std::vector<world::SourceInfo>& sources() const override { return sources_; }
  std::string input_hash() const override { return {}; }

 private:
  const geo::WorldFrame frame_;
  const double jump_m_;
  const geo::VerticalDatum datum_;
  const std::vector<world::SourceInfo> sources_;
};

TEST(GeodesyCells, RefuseAProjectionThatJumpsWithinTheSquare) {
  const geo::WorldFrame frame({.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg});
  const auto cells_of = [&](double jump_m) {
    const SeamedField field(frame, jump_m);
    return tiler::GeodesyCells(frame, field, nullptr, 512.0, 0.0, 100.0);
  };
  EXPECT_LE(cells_of(0.0).largest_probe_error_m(), tiler::GeodesyCells::kTolerance_m);
  expect_error(core::ErrorKind::Input, {"projection", "within the world's square", "gdalwarp"},
               [&] { cells_of(100.0); });
}

TEST(Surface, HeightsOutsideTheSquareAreNotMeasured) {
  const auto surface = prepare(world_of("plane"));
  EXPECT_TRUE(surface->measured_height_m(kOriginLat_deg, kOriginLon_deg).has_value());
  EXPECT_FALSE(surface->measured_height_m(kOriginLat_deg + 0.02, kOriginLon_deg).has_value());
  EXPECT_FALSE(surface->measured_height_m(-kOriginLat_deg, kOriginLon_deg - 180.0).has_value());
  EXPECT_FALSE(surface->measured_height_m(0.0, 0.0).has_value());
}

/// Procedural land is slow to raise: one for all tests.
std::shared_ptr<const tiler::WorldSurface> procedural_surface() {
  static const auto surface = [] {
    tiler::WorldOptions options = world_of("procedural", 8192.0);
    options.seed = 1;
    return prepare(options);
  }();
  return surface;
}

/// 51.2 km of procedural land whose sea lies 12 m above the geoid.
std::shared_ptr<const tiler::WorldSurface> coast_surface() {
  static const auto surface = [] {
    tiler::WorldOptions options = world_of("procedural", 51200.0);
    options.elevation[0].vertical_datum = "egm96";
    options.elevation[0].sea_level_m = 12.0;
    return prepare(options);
  }();
  return surface;
}

/// A place of the procedural square on rugged land.
Eigen::Vector2d rugged_place(const tiler::WorldSurface& surface) {
  Eigen::Vector2d best = Eigen::Vector2d::Zero();
  double steepest = 0.0;
  for (double y = -3500.0; y < 3500.0; y += 250.0)
    for (double x = -3500.0; x < 3500.0; x += 250.0) {
      const double rise =
          std::abs(surface.sample(x + 128.0, y).z_world - surface.sample(x, y).z_world);
      if (rise > steepest) {
        steepest = rise;
        best = {x, y};
      }
    }
  return best;
}

TEST(Tiles, SampleTileIsSampleAtEveryPlaceOfEveryLevel) {
  const auto surface = procedural_surface();
  const Eigen::Vector2d at = rugged_place(*surface);
  std::vector<SurfaceSample> samples(static_cast<std::size_t>(kTileSamples) * kTileSamples);
  for (int level = -2; level <= 10; ++level) {
    const TileId id = world::tile_at(level, at.x(), at.y());
    surface->sample_tile(id, samples);
    for (int k = 0; k < 200; ++k) {
      const int i = (k * 37) % kTileSamples;
      const int j = (k * 101) % kTileSamples;
      const Eigen::Vector2d place = id.corner_world() + id.spacing_m() * Eigen::Vector2d(i, j);
      const SurfaceSample one = surface->sample(place.x(), place.y());
      const SurfaceSample& other = samples[Tile::sample(i, j)];
      ASSERT_EQ(one.z_world, other.z_world) << id.name() << " " << i << " " << j;
      ASSERT_EQ(one.cover, other.cover);
      ASSERT_EQ(one.moisture, other.moisture);
      ASSERT_EQ(one.source, other.source);
    }
  }
}

TEST(Tiles, NeighboursShareTheirBordersBitForBit) {
  const auto surface = procedural_surface();
  const Eigen::Vector2d at = rugged_place(*surface);
  for (const int level : {0, 2, 4, 6, 8}) {
    const TileId id = world::tile_at(level, at.x(), at.y());
    const Tile here = build_tile(*surface, id);
    const Tile east = build_tile(*surface, id.neighbour(1, 0));
    const Tile north = build_tile(*surface, id.neighbour(0, 1));
    for (int k = 0; k < kTileSamples; ++k) {
      ASSERT_EQ(here.z_world(kTileSamples - 1, k), east.z_world(0, k)) << id.name();
      ASSERT_EQ(here.z_world(k, kTileSamples - 1), north.z_world(k, 0)) << id.name();
    }
  }
}

TEST(Tiles, ACoarseLevelTakesEverySecondSampleOfTheFiner) {
  const auto surface = procedural_surface();
  const Eigen::Vector2d at = rugged_place(*surface);
  for (int level = 0; level <= 9; ++level) {
    const TileId parent = world::tile_at(level + 1, at.x(), at.y());
    const Tile coarse = build_tile(*surface, parent);
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      const Tile fine = build_tile(*surface, parent.child(quadrant));
      for (int j = 0; j < kTileSamples; j += 2)
        for (int i = 0; i < kTileSamples; i += 2) {
          const int ci = i / 2 + (quadrant & 1) * world::kTileCells / 2;
          const int cj = j / 2 + (quadrant >> 1) * world::kTileCells / 2;
          ASSERT_EQ(fine.z_world(i, j), coarse.z_world(ci, cj)) << parent.name();
          ASSERT_EQ(fine.cover[Tile::sample(i, j)], coarse.cover[Tile::sample(ci, cj)]);
          ASSERT_EQ(fine.moisture[Tile::sample(i, j)], coarse.moisture[Tile::sample(ci, cj)]);
        }
    }
  }
}

TEST(Tiles, HeightsLieOnTheLatticeAboutAWholeMetre) {
  const auto surface = procedural_surface();
  const Tile tile = build_tile(*surface, {4, 0, 0});
  EXPECT_EQ(tile.center_z_m, std::round(tile.center_z_m));
  const auto sample = surface->sample(16.0 * 40, 16.0 * 70);
  EXPECT_NEAR(tile.z_world(40, 70), sample.z_world, 0.5 * world::kHeightStep_m);
}

TEST(Detail, VanishesExactlyAtThePlacesOfMeasuredLevels) {
  tiler::WorldOptions options = world_of("procedural", 8192.0);
  options.detail_roughness = 0.0;
  const auto smooth = prepare(options);
  const auto rough = procedural_surface();
  const Eigen::Vector2d at = rugged_place(*rough);
  ASSERT_EQ(rough->measured_level(), smooth->measured_level());
  bool differs = false;
  for (int level = rough->measured_level() - 1; level <= rough->measured_level() + 2; ++level) {
    const TileId id = world::tile_at(level, at.x(), at.y());
    const Tile a = build_tile(*rough, id);
    const Tile b = build_tile(*smooth, id);
    if (level >= rough->measured_level()) {
      EXPECT_EQ(a, b) << level;
    } else {
      differs = differs || !(a == b);
    }
  }
  EXPECT_TRUE(differs);
}

TEST(Detail, FadesOnPlainsAndGrowsWithTheSlope) {
  const tiler::Detail detail(7, 6, 1.0);
  const auto rms_m = [&](double ruggedness) {
    double sum = 0.0;
    for (int k = 0; k < 4000; ++k) {
      const double h = detail.height_m(3.7 * k, 911.3 - 5.3 * k, ruggedness);
      sum += h * h;
    }
    return std::sqrt(sum / 4000.0);
  };
  EXPECT_EQ(rms_m(0.0), 0.0);
  EXPECT_LT(rms_m(0.01), 0.1);
  EXPECT_NEAR(rms_m(0.5) / rms_m(0.25), 2.0, 1e-9);
  // A mountain side of 45 degrees: some metres of what 64 m do not show, not tens.
  EXPECT_GT(rms_m(1.0), 1.0);
  EXPECT_LT(rms_m(1.0), 8.0);
}

TEST(Detail, AddsRelativeSlopesThatLookLikeGroundAtOneMetre) {
  // A one metre tile of rugged land: rougher than the measured ground, but no wall of noise.
  const auto surface = procedural_surface();
  const Eigen::Vector2d at = rugged_place(*surface);
  const Tile tile = build_tile(*surface, world::tile_at(0, at.x(), at.y()));
  double sum = 0.0;
  for (int j = 0; j < kTileSamples; ++j)
    for (int i = 0; i + 2 < kTileSamples; ++i) {
      const double bend =
          tile.z_world(i, j) - 2.0 * tile.z_world(i + 1, j) + tile.z_world(i + 2, j);
      sum += bend * bend;
    }
  const double rms_bend_m = std::sqrt(sum / (kTileSamples * (kTileSamples - 2.0)));
  EXPECT_GT(rms_bend_m, 0.01);
  EXPECT_LT(rms_bend_m, 0.4);
}

TEST(Apron, MeetsTheSquareAndReachesTheHorizonWithoutCliffs) {
  const auto surface = procedural_surface();
  const double half = 4096.0;
  for (double t = -half; t <= half; t += 333.0) {
    const double inside = surface->sample(half, t).z_world;
    const double outside = surface->sample(half + 0x1.0p-10, t).z_world;
    EXPECT_NEAR(inside, outside, 0.02) << t;  // a millimetre of ground apart
    const Cover cover = surface->sample(half, t).cover;
    EXPECT_NE(cover, Cover::Outside);
    EXPECT_EQ(surface->sample(half + 0x1.0p-10, t).cover,
              cover == Cover::Sea ? Cover::Sea : Cover::Outside);
  }
  for (double far = 30000.0; far < 260000.0; far += 17000.0)
    for (const double angle : {0.1, 1.3, 2.9, 4.4, 5.6}) {
      const geo::Geodetic place = place_of(*surface, far * std::cos(angle), far * std::sin(angle));
      EXPECT_GT(place.height_m, -500.0);
      EXPECT_LT(place.height_m, 3000.0);
    }
}

TEST(Apron, TheSeaGoesOnBeyondTheBorderAtItsOwnLevel) {
  // A strip of sand once ended the sea at the world's border, since all beyond it was land.
  const auto surface = coast_surface();
  const auto geoid = geo::Geoid::egm96();
  const double half = 25600.0;
  std::map<Cover, int> num_far;
  int num_sea = 0;
  for (double t = -half + 1.0; t < half; t += 400.0)
    for (const Eigen::Vector2d& out : {Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0),
                                       Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)}) {
      const Eigen::Vector2d along(out.y(), out.x());
      const Eigen::Vector2d border = half * out + t * along;
      const bool is_sea = surface->sample(border.x(), border.y()).cover == Cover::Sea;
      num_sea += is_sea ? 1 : 0;
      for (const double distance_m : {0.001, 30.0, 900.0, 3000.0, 9000.0, 20000.0, 120000.0}) {
        const Eigen::Vector2d at = border + distance_m * out;
        const SurfaceSample sample = surface->sample(at.x(), at.y());
        ASSERT_NE(sample.cover, Cover::Land);
        if (distance_m < 1.0) {
          EXPECT_EQ(sample.cover == Cover::Sea, is_sea) << at.transpose();
        }
        if (distance_m > 1e5) ++num_far[sample.cover];
        EXPECT_EQ(surface->sources()[sample.source].kind == "sea", sample.cover == Cover::Sea);
        if (sample.cover != Cover::Sea) continue;
        const geo::Geodetic place =
            surface->frame().geodetic_from_world({at.x(), at.y(), sample.z_world});
        // 2 cm: the geoid's cubic jumps between its cells.
        EXPECT_NEAR(place.height_m - geoid->undulation_m(place.lat_deg, place.lon_deg), 12.0, 0.02)
            << at.transpose();
      }
    }
  EXPECT_GT(num_sea, 50);
  // Neither swallows the other out there.
  EXPECT_GT(num_far[Cover::Sea], 50);
  EXPECT_GT(num_far[Cover::Outside], 50);
}

TEST(Apron, AWorldWithoutSeaListsNone) {
  const auto has_sea = [](const tiler::WorldOptions& options) {
    const auto surface = prepare(options);
    return std::any_of(surface->sources().begin(), surface->sources().end(),
                       [](const world::SourceInfo& source) { return source.kind == "sea"; });
  };
  tiler::WorldOptions options = world_of("plane");
  EXPECT_FALSE(has_sea(options));
  options.outside = "sea";
  EXPECT_TRUE(has_sea(options));
}

TEST(Apron, SinksIntoTheSeaThatTheConfigAsksFor) {
  tiler::WorldOptions options = world_of("plane");
  options.elevation[0].height_m = 400.0;
  options.outside = "sea";
  const auto surface = prepare(options);
  const auto geoid = geo::Geoid::egm96();
  const geo::Geodetic far = place_of(*surface, 60000.0, -30000.0);
  // Its own place's undulation, exactly: nothing is interpolated out there.
  EXPECT_NEAR(far.height_m, geoid->undulation_m(far.lat_deg, far.lon_deg), 1e-4);
  const SurfaceSample sea = surface->sample(60000.0, -30000.0);
  EXPECT_EQ(sea.cover, Cover::Sea);
  EXPECT_EQ(surface->sources()[sea.source].kind, "sea");
  EXPECT_EQ(surface->sample(2049.0, 0.0).cover, Cover::Outside);  // land yet
  EXPECT_NEAR(place_of(*surface, 2047.0, 0.0).height_m, 400.0, 1e-6);
}

TEST(Procedural, HasMountainsPlainCoastAndSeaThatLiesAtItsLevel) {
  const auto surface = coast_surface();
  const auto geoid = geo::Geoid::egm96();
  int num_sea = 0;
  int num_plain = 0;
  int num_mountain = 0;
  int num_places = 0;
  for (double y = -25000.0; y <= 25000.0; y += 1000.0)
    for (double x = -25000.0; x <= 25000.0; x += 1000.0) {
      const SurfaceSample sample = surface->sample(x, y);
      const geo::Geodetic place = surface->frame().geodetic_from_world({x, y, sample.z_world});
      const double above_geoid_m =
          place.height_m - geoid->undulation_m(place.lat_deg, place.lon_deg);
      ++num_places;
      if (sample.cover == Cover::Sea) {
        ++num_sea;
        EXPECT_NEAR(above_geoid_m, 12.0, 0.02);  // the geoid's cubic jumps between its cells
      } else {
        EXPECT_GT(above_geoid_m, 11.9);
        num_plain += above_geoid_m < 150.0 ? 1 : 0;
        num_mountain += above_geoid_m > 700.0 ? 1 : 0;
      }
    }
  EXPECT_GT(num_sea, num_places / 20);
  EXPECT_GT(num_plain, num_places / 20);
  EXPECT_GT(num_mountain, num_places / 40);
  EXPECT_GT(surface->highest_m(), 1500.0);
}

TEST(Procedural, AnotherSeedIsAnotherLandAndAnotherHash) {
  tiler::WorldOptions options = world_of("procedural", 4096.0);
  const auto one = prepare(options);
  const auto again = prepare(options, 1);
  options.seed = 2;
  const auto other = prepare(options);
  EXPECT_EQ(one->input_hash(), again->input_hash());
  EXPECT_NE(one->input_hash(), other->input_hash());
  int num_equal = 0;
  for (const Eigen::Vector2d& at : scattered_places(4096.0)) {
    EXPECT_EQ(one->sample(at.x(), at.y()).z_world, again->sample(at.x(), at.y()).z_world);
    num_equal += one->sample(at.x(), at.y()).z_world == other->sample(at.x(), at.y()).z_world;
  }
  EXPECT_LT(num_equal, 5);
}

TEST(Registry, KindsAreNamedInOrderAndDescribed) {
  std::string previous;
  for (const tiler::ElevationKindInfo& kind : tiler::elevation_kinds()) {
    EXPECT_LT(previous, kind.name);
    EXPECT_FALSE(kind.summary.empty());
    previous = kind.name;
  }
}

TEST(Laws, EveryAnalyticKindMakesASurfaceOfItsOwnHash) {
  std::set<std::string> hashes;
  for (const tiler::ElevationKindInfo& kind : tiler::elevation_kinds()) {
    if (kind.name == "raster") continue;
    const auto surface = prepare(world_of(std::string(kind.name), 2048.0));
    EXPECT_TRUE(hashes.insert(surface->input_hash()).second) << kind.name;
    EXPECT_TRUE(std::isfinite(surface->sample(100.0, -700.0).z_world)) << kind.name;
    EXPECT_LE(surface->lowest_m(), surface->highest_m());
    EXPECT_GE(surface->base_level(), surface->measured_level());
  }
}

}  // namespace
}  // namespace terracast::test
