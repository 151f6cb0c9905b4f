#include <cmath>

#include "scene/ground/pattern.h"
#include "scene/objects/looks/families.h"

namespace terracast::scene {
namespace {

using world::Material;

/// Tiles in rows, each row over the one below, columns shifted from row to row.
struct Tiling {
  double wide_m;
  double row_m;
  float tone;    ///< by how much tiles differ
  float bulge;   ///< slope across a tile: pantiles are waves
  float shadow;  ///< share of a row that lies in the shadow of the next
};

void lay_tiles(const ObjectPlace& place, const Tiling& tiling, Rgb& color, ObjectLook& look) {
  const auto width_m = static_cast<double>(place.footprint_m);
  const double row = std::floor(place.v_m / tiling.row_m);
  const double shifted_m = place.u_m + 0.5 * tiling.wide_m * (row - 2.0 * std::floor(0.5 * row));
  const double column = std::floor(shifted_m / tiling.wide_m);
  const float seen = told(place.footprint_m, 1.6f * static_cast<float>(tiling.wide_m));
  shade(color, 1.0f + 2.0f * tiling.tone * seen * (cell_tint(place.seed, column, row) - 0.5f));
  // The butt of each row throws a shadow; joints between tiles are dark.
  const double butt = share_of_bars(
      place.v_m, width_m, static_cast<double>(tiling.shadow) * tiling.row_m, tiling.row_m);
  const double joint = share_of_bars(shifted_m, width_m, 0.008, tiling.wide_m);
  shade(color, 1.0f - 0.45f * static_cast<float>(butt) - 0.35f * static_cast<float>(joint));
  const auto in_tile = static_cast<float>(shifted_m / tiling.wide_m - column) - 0.5f;
  look.normal = bent(place, -2.0f * tiling.bulge * seen * in_tile, 0.0f);
}

/// Lichen and moss, where it is damp: in patches, more on old roofs.
void grow_moss(const ObjectPlace& place, float most, Rgb& color) {
  const float age = object_tint(place, 21);
  const float patch = ramp(0.35f * place.coarse + 0.25f * place.fine + age - 0.75f);
  lay(color, most * patch, 0.090f, 0.095f, 0.055f);
}

/// A number of -1 … 1 along u, linear between lines of a period; its mean where a sample is wider.
float streak(const ObjectPlace& place, std::uint64_t question, double period_m) {
  const double line = place.u_m / period_m;
  const double low = std::floor(line);
  const float first = cell_tint(place.seed ^ question, low, 1.0);
  const float second = cell_tint(place.seed ^ question, low + 1.0, 1.0);
  const float value = first + static_cast<float>(line - low) * (second - first);
  return told(place.footprint_m, 2.0f * static_cast<float>(period_m)) * (2.0f * value - 1.0f);
}

/// What clay was fired to and what years make of it. Kilns differ from deep red to straw: gains that are
/// 1 in the mean of all houses. Soot and lichen take the red out, more of them on old roofs, on slopes to
/// the north, and in runs of rain down the slope; here and there tiles were mended.
void weather_clay(const ObjectPlace& place, Rgb& color) {
  // Of its colour a quarter is gone with the sun and the lime of its mortar.
  const float grey = 0.3f * color.r + 0.6f * color.g + 0.1f * color.b;
  lay(color, 0.26f, grey, grey, grey);
  const float kiln = object_tint(place, 26) + object_tint(place, 27) - 1.0f;
  color.r *= 1.0f - 0.09f * kiln;
  color.g *= 1.0f + 0.18f * kiln;
  color.b *= 1.0f + 0.30f * kiln;
  const float age = object_tint(place, 25);
  // Of the world's north; half of all roofs turn from it.
  const float shaded = 0.5f * place.normal.y();
  const float runs = 0.6f * streak(place, 41, 0.5) + 0.4f * streak(place, 43, 1.7);
  const float grime =
      clamped(0.12f + 0.56f * age * age + (0.10f + 0.24f * age) * (shaded + 0.55f * runs) +
                  (0.05f + 0.05f * age) * place.coarse,
              0.0f, 0.85f);
  lay(color, grime, 0.142f, 0.121f, 0.100f);
  shade(color, 1.0f + 0.07f * place.coarse + 0.05f * place.fine);
  // A patch of newer tiles in one of 16 cells of 2.4 m x 1.7 m.
  constexpr float kMended = 1.0f / 16.0f;
  const float mended =
      cell_tint(place.seed ^ 45, std::floor(place.u_m / 2.4), std::floor(place.v_m / 1.7)) < kMended
          ? 1.0f
          : 0.0f;
  const float share = 0.30f * age * faded(mended, kMended, told(place.footprint_m, 2.0f));
  lay(color, share, 0.340f, 0.150f, 0.085f);
}

void look_at_flat_roof(const ObjectPlace& place, Rgb& color, ObjectLook& look) {
  const auto width_m = static_cast<double>(place.footprint_m);
  const float kind = object_tint(place, 22);
  shade(color, 0.80f);  // dust
  if (kind < 0.45f) {
    // Gravel.
    lay(color, 0.55f, 0.250f, 0.240f, 0.220f);
    shade(color, clamped(1.0f + 0.07f * place.coarse + 0.16f * place.fine, 0.5f, 1.6f));
  } else if (kind < 0.85f) {
    // Sheets of bitumen or plastic of 1 m, lapped.
    shade(color, 1.0f + 0.08f * place.coarse + 0.05f * place.fine);
    const double sheet = std::floor(place.u_m);
    shade(color, 1.0f + 0.10f * told(place.footprint_m, 2.0f) *
                            (cell_tint(place.seed, sheet, 2.0) - 0.5f));
    const double lap = share_of_bars(place.u_m, width_m, 0.06, 1.0);
    shade(color, 1.0f - 0.30f * static_cast<float>(lap));
  } else {
    // Sown with stonecrop, red where it is dry.
    lay(color, 0.80f, 0.092f, 0.108f, 0.046f);
    lay(color, 0.5f * ramp(0.5f * place.coarse + 0.1f), 0.140f, 0.100f, 0.060f);
    shade(color, clamped(1.0f + 0.12f * place.fine, 0.5f, 1.5f));
  }
  // Where water stands after rain.
  lay(color, 0.35f * ramp(place.coarse - 0.7f), 0.085f, 0.080f, 0.072f);
  // Vents, domes and boxes of machines, each in a cell of 5 m; they stand 0.4 m high in a sun from the
  // south, which is what is drawn of their shadow.
  constexpr double kCell_m = 5.0;
  const double column = std::floor(place.u_m / kCell_m);
  const double row = std::floor(place.v_m / kCell_m);
  const float chance = cell_tint(place.seed ^ 31, column, row);
  const float seen = told(place.footprint_m, 5.0f);
  if (chance < 0.22f) {
    const double side_m = 0.5 + 6.0 * static_cast<double>(chance);
    const double u = place.u_m - kCell_m * column - 1.2;
    const double v = place.v_m - kCell_m * row - 1.2;
    const auto box = static_cast<float>(share_within(u, width_m, 0.0, side_m) *
                                        share_within(v, width_m, 0.0, side_m));
    const auto rim = static_cast<float>(share_within(u, width_m, -0.10, side_m + 0.10) *
                                        share_within(v, width_m, -0.10, side_m + 0.10));
    lay(color, 0.6f * seen * (rim - box), 0.050f, 0.050f, 0.050f);
    lay(color, seen * box, 0.330f, 0.330f, 0.320f);
  }
  // From far, what all of them cover.
  lay(color, 0.0027f * (1.0f - seen), 0.050f, 0.050f, 0.050f);
  lay(color, 0.013f * (1.0f - seen), 0.330f, 0.330f, 0.320f);
  look.openness = 0.95f;
}

void look_at_metal_roof(const ObjectPlace& place, Rgb& color, ObjectLook& look) {
  const auto width_m = static_cast<double>(place.footprint_m);
  constexpr double kSeam_m = 0.53;
  const double sheet = std::floor(place.u_m / kSeam_m);
  // Zinc and paint chalk, and soot lies on what was white.
  shade(color, 0.68f);
  shade(color,
        1.0f + 0.10f * told(place.footprint_m, 1.0f) * (cell_tint(place.seed, sheet, 4.0) - 0.5f));
  shade(color, 1.0f + 0.06f * place.coarse + 0.03f * place.fine);
  // Dirt that rain has washed down, more on old ones.
  shade(color, 1.0f + (0.05f + 0.14f * object_tint(place, 28)) *
                          (0.5f * streak(place, 47, 0.8) + 0.5f * streak(place, 49, 4.0)));
  const double seam = share_of_bars(place.u_m, width_m, 0.03, kSeam_m);
  const double shadow = share_of_bars(place.u_m - 0.03, width_m, 0.04, kSeam_m);
  shade(color, 1.0f + 0.15f * static_cast<float>(seam) - 0.35f * static_cast<float>(shadow));
  // Run-off and rust.
  const float rust = object_tint(place, 24) * ramp(0.6f * place.coarse - 0.5f);
  lay(color, 0.5f * rust, 0.150f, 0.070f, 0.035f);
  look.gloss.share = 0.45f * (1.0f - rust);
  look.gloss.facing = {0.18f, 0.18f, 0.18f};
  look.gloss.roughness = 0.34f;
}

void look_at_thatch(const ObjectPlace& place, Rgb& color, ObjectLook& look) {
  shade(color, clamped(1.0f + 0.12f * place.coarse + 0.20f * place.fine, 0.4f, 1.6f));
  const float straw = cell_tint(place.seed, std::floor(place.u_m / 0.02), 1.0) - 0.5f;
  shade(color, 1.0f + 0.5f * told(place.footprint_m, 0.04f) * straw);
  grow_moss(place, 0.7f, color);
  look.normal = bent(place, 0.10f * place.fine, 0.05f * place.coarse);
  look.openness = 0.88f;
}

}  // namespace

void look_at_roof(const ObjectPlace& place, ObjectLook& look) {
  Rgb color = place.color;
  // Of some years and of many: no two are quite alike.
  shade(color, 0.80f + 0.40f * object_tint(place, 20));
  switch (place.finish.material) {
    case Material::RoofTiles:
      lay_tiles(place,
                {.wide_m = 0.22, .row_m = 0.34, .tone = 0.20f, .bulge = 0.35f, .shadow = 0.16f},
                color, look);
      weather_clay(place, color);
      grow_moss(place, 0.55f, color);
      look.openness = 0.95f;
      break;
    case Material::Slate:
      lay_tiles(place,
                {.wide_m = 0.25, .row_m = 0.20, .tone = 0.16f, .bulge = 0.05f, .shadow = 0.10f},
                color, look);
      shade(color, 1.0f + 0.06f * place.coarse);
      grow_moss(place, 0.35f, color);
      look.gloss = {.share = 0.7f,
                    .facing = {0.04f, 0.04f, 0.04f},
                    .roughness = 0.35f,
                    .normal = look.normal};
      break;
    case Material::FlatRoof:
      look_at_flat_roof(place, color, look);
      break;
    case Material::MetalRoof:
      look_at_metal_roof(place, color, look);
      break;
    default:
      look_at_thatch(place, color, look);
      break;
  }
  look.albedo = color;
}

}  // namespace terracast::scene
