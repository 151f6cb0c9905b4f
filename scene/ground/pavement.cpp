#include "scene/ground/pavement.h"

#include <cmath>

#include "core/random.h"
#include "scene/ground/marking.h"
#include "scene/ground/pattern.h"

namespace terracast::scene {
namespace {

using world::Marking;
using world::Paving;

/// Where on a strip or an area, in the frame that its patterns follow.
struct Grid {
  double across_m;
  double along_m;
};

Grid grid_of(const PavedPlace& place) {
  const bool has_line = place.paint.half_width_m > 0.0;
  return has_line ? Grid{place.paint.across_m, place.paint.along_m} : Grid{place.x_m, place.y_m};
}

std::uint64_t seed_of(const PavedPlace& place, std::uint32_t seed) {
  return core::random_bits(seed, place.paint.coating.layer, place.paint.coating.feature);
}

/// A number of [-1, 1] of the feature alone.
float feature_tint(std::uint64_t bits) {
  return 2.0f * static_cast<float>(bits >> 40) * 0x1.0p-24f - 1.0f;
}

/// Middles of the ways of wheels: lanes of a road, or the middle of what has no lanes.
float wheel_share(const PavedPlace& place) {
  const world::PaintSample& paint = place.paint;
  if (paint.half_width_m <= 0.0 || paint.marking == Marking::Runway ||
      paint.marking == Marking::Stands || paint.marking == Marking::Crossing)
    return 0.0f;
  const double lane_m = 2.0 * paint.half_width_m / std::max<int>(paint.num_lanes, 1);
  if (lane_m < 2.2) return 0.0f;
  const double from_edge_m = paint.across_m + paint.half_width_m;
  const double in_lane_m = from_edge_m - std::floor(from_edge_m / lane_m) * lane_m - 0.5 * lane_m;
  const double from_wheel_m = std::abs(std::abs(in_lane_m) - 0.85);
  const auto distance = static_cast<float>(from_wheel_m);
  return told(place.footprint_m, 1.6f) * ramp(1.0f - distance / 0.45f);
}

void lay_asphalt(const PavedPlace& place, std::uint64_t bits, PavedLook& look) {
  const Grid at = grid_of(place);
  const double width_m = static_cast<double>(place.footprint_m);
  const float age = 0.5f + 0.5f * feature_tint(bits);  // 0 new and black, 1 old and grey
  Rgb color{0.052f, 0.052f, 0.054f};
  lay(color, age, 0.125f, 0.122f, 0.116f);

  // Stretches of other years, laid lane by lane.
  const double stretch_m = 90.0 + 160.0 * static_cast<double>(cell_tint(bits, 1, 0));
  const double stretch = std::floor(at.along_m / stretch_m);
  shade(color, 0.90f + 0.20f * cell_tint(bits, 7, stretch));

  // Patches where pipes were laid or holes were filled, and the seams around them.
  const double cell_along_m = 17.0;
  const double cell_across_m = 2.9;
  const double column = std::floor(at.across_m / cell_across_m);
  const double row = std::floor(at.along_m / cell_along_m);
  const float chance = cell_tint(bits, column + 31.0, row);
  if (chance < 0.03f + 0.06f * age) {
    const double from_m = 1.0 + 9.0 * static_cast<double>(cell_tint(bits ^ 1, column, row));
    const double long_m = 1.2 + 5.5 * static_cast<double>(cell_tint(bits ^ 2, column, row));
    const double in_m = at.across_m - column * cell_across_m;
    const double on_m = at.along_m - row * cell_along_m;
    const double inside = share_within(on_m, width_m, from_m, from_m + long_m) *
                          share_within(in_m, width_m, 0.25, 2.65);
    const double with_seam = share_within(on_m, width_m, from_m - 0.06, from_m + long_m + 0.06) *
                             share_within(in_m, width_m, 0.19, 2.71);
    lay(color, 0.55f * static_cast<float>(with_seam - inside), 0.030f, 0.030f, 0.032f);
    lay(color, 0.75f * static_cast<float>(inside), 0.066f, 0.066f, 0.068f);
  }

  // Polished ways of wheels, oil between them.
  shade(color, 1.0f + 0.16f * (age - 0.3f) * wheel_share(place));
  // Joints between the widths that were laid at once, and tar over cracks.
  if (place.paint.half_width_m > 0.0) {
    const double lane_m = 2.0 * place.paint.half_width_m / std::max<int>(place.paint.num_lanes, 1);
    const double lay_m = lane_m > 7.5 ? 7.5 : lane_m;
    const double joint =
        share_of_bars(at.across_m + place.paint.half_width_m + 0.02, width_m, 0.04, lay_m);
    lay(color, 0.5f * age * static_cast<float>(joint), 0.028f, 0.028f, 0.030f);
  }
  const float crack = told(place.footprint_m, 0.5f) * age *
                      ramp(1.0f - 22.0f * absolute(place.clump + 0.05f * place.fine)) *
                      step_up(place.patch + 0.4f, 0.5f);
  lay(color, 0.65f * crack, 0.028f, 0.028f, 0.030f);
  shade(color, clamped(1.0f + 0.07f * place.coarse + 0.05f * place.clump + 0.07f * place.grain +
                           0.16f * place.fine,
                       0.5f, 1.6f));
  look = {.albedo = color, .openness = 0.97f};
}

void lay_concrete(const PavedPlace& place, std::uint64_t bits, PavedLook& look) {
  const Grid at = grid_of(place);
  const double width_m = static_cast<double>(place.footprint_m);
  const bool is_airfield = place.paint.coating.semantic_class == core::SemanticClass::Runway ||
                           place.paint.coating.semantic_class == core::SemanticClass::Taxiway ||
                           place.paint.coating.semantic_class == core::SemanticClass::Apron;
  const double slab_m = is_airfield ? 7.5 : 5.0;
  const float slab =
      cell_tint(bits, std::floor(at.across_m / slab_m), std::floor(at.along_m / slab_m));
  Rgb color{0.290f, 0.278f, 0.252f};
  const float fade = told(place.footprint_m, static_cast<float>(slab_m));
  shade(color, 1.0f + 0.06f * feature_tint(bits) + 0.16f * fade * (slab - 0.5f));
  if (slab > 0.965f) lay(color, 0.5f * fade, 0.380f, 0.370f, 0.345f);  // replaced
  const float stain = ramp(0.5f * place.clump + 0.35f * place.grain - 0.35f);
  lay(color, 0.30f * stain, 0.130f, 0.122f, 0.110f);
  const double joint = share_of_joints(at.across_m, at.along_m, width_m, 0.03, slab_m, slab_m);
  lay(color, 0.85f * static_cast<float>(joint), 0.050f, 0.048f, 0.045f);
  // Dirt along joints.
  const double dirt = share_of_joints(at.across_m, at.along_m, width_m, 0.35, slab_m, slab_m);
  lay(color, 0.20f * static_cast<float>(dirt), 0.170f, 0.158f, 0.138f);
  shade(color, clamped(1.0f + 0.05f * place.coarse + 0.05f * place.grain + 0.08f * place.fine, 0.6f,
                       1.4f));
  look = {.albedo = color, .openness = 0.98f};
}

void lay_cobbles(const PavedPlace& place, std::uint64_t bits, PavedLook& look) {
  const Grid at = grid_of(place);
  const double width_m = static_cast<double>(place.footprint_m);
  // Rows of stones of 0.16 m x 0.11 m, each shifted by half a stone.
  constexpr double kStone_m = 0.16;
  constexpr double kRow_m = 0.11;
  constexpr double kGap_m = 0.012;
  const double row = std::floor(at.along_m / kRow_m);
  const double shifted_m = at.across_m + 0.5 * kStone_m * (row - 2.0 * std::floor(0.5 * row));
  const double column = std::floor(shifted_m / kStone_m);
  const float fade = told(place.footprint_m, 0.25f);
  const float stone = cell_tint(bits, column, row);
  Rgb color{0.165f, 0.158f, 0.150f};
  lay(color, 0.5f + 0.5f * fade * (2.0f * stone - 1.0f), 0.235f, 0.222f, 0.205f);
  const double gap = share_of_joints(shifted_m, at.along_m, width_m, kGap_m, kStone_m, kRow_m);
  lay(color, static_cast<float>(gap), 0.060f, 0.056f, 0.046f);
  shade(color, clamped(1.0f + 0.06f * place.coarse + 0.07f * place.clump + 0.06f * place.grain +
                           0.12f * place.fine,
                       0.5f, 1.5f));
  look = {.albedo = color, .openness = 0.90f};
}

void lay_gravel(const PavedPlace& place, std::uint64_t bits, PavedLook& look) {
  Rgb color{0.265f, 0.248f, 0.215f};
  shade(color, 1.0f + 0.12f * feature_tint(bits));
  // Ways of wheels are bare and bright, what they throw aside lies between.
  const float wheels = wheel_share(place);
  lay(color, 0.35f * wheels, 0.330f, 0.305f, 0.260f);
  shade(color, clamped(1.0f + 0.06f * place.coarse + 0.08f * place.clump + 0.12f * place.grain +
                           0.26f * place.fine,
                       0.4f, 1.7f));
  look = {.albedo = color, .openness = 0.90f};
}

void lay_earth(const PavedPlace& place, std::uint64_t bits, PavedLook& look) {
  Rgb color{0.190f, 0.140f, 0.090f};
  shade(color, 1.0f + 0.15f * feature_tint(bits));
  const world::PaintSample& paint = place.paint;
  float hollow = 0.0f;
  if (paint.half_width_m > 0.9 && paint.half_width_m < 2.6) {
    // A track: two ruts, grass between and beside.
    const auto across = static_cast<float>(paint.across_m) + 0.12f * place.clump;
    const float from_rut_m = absolute(absolute(across) - 0.75f);
    const float fade = told(place.footprint_m, 1.8f);
    const float rut = fade * step_up(0.38f - from_rut_m, 0.14f) + (1.0f - fade) * 0.42f;
    Rgb grass{0.085f, 0.105f, 0.035f};
    lay(grass, ramp(0.4f + 0.3f * place.clump), 0.170f, 0.150f, 0.065f);
    lay(color, (1.0f - rut) * ramp(0.75f + 0.35f * place.grain), grass);
    hollow = 0.10f * rut;
  }
  shade(color, clamped(1.0f + 0.08f * place.coarse + 0.09f * place.clump + 0.11f * place.grain +
                           0.16f * place.fine,
                       0.4f, 1.7f));
  look = {.albedo = color, .openness = 0.92f - hollow};
}

void lay_ballast(const PavedPlace& place, std::uint64_t bits, PavedLook& look) {
  // Crushed stone of 32 to 63 mm, brown from brakes and rust in the middle of the track.
  Rgb color{0.170f, 0.155f, 0.140f};
  shade(color, 1.0f + 0.12f * feature_tint(bits));
  const float stones = told(place.footprint_m, 0.12f);
  shade(color, clamped(1.0f + 0.06f * place.coarse + 0.06f * place.clump + 0.12f * place.grain +
                           (0.12f + 0.22f * stones) * place.fine,
                       0.35f, 1.8f));
  look = {.albedo = color, .openness = 0.86f};
  if (place.paint.marking != Marking::Rails) return;

  const auto width_m = static_cast<double>(place.footprint_m);
  const TrackCover track = tracks_within(place.paint, width_m);
  lay(look.albedo,
      0.35f * static_cast<float>(tracks_within(place.paint, width_m + 1.1).rail) * 8.0f, 0.125f,
      0.092f, 0.068f);
  Rgb sleeper{0.285f, 0.272f, 0.245f};
  const double in_spacing = std::floor(place.paint.along_m / 0.60);
  shade(sleeper, 0.9f + 0.2f * told(place.footprint_m, 0.6f) * cell_tint(bits, 3, in_spacing) +
                     0.06f * place.fine);
  lay(look.albedo, static_cast<float>(track.sleeper), sleeper);
  lay(look.albedo, static_cast<float>(track.rail_side), 0.070f, 0.042f, 0.028f);
  lay(look.albedo, static_cast<float>(track.rail), 0.420f, 0.415f, 0.410f);
}

void lay_grass(const PavedPlace& place, std::uint64_t bits, PavedLook& look) {
  Rgb color{0.072f, 0.110f, 0.030f};
  lay(color, ramp(0.35f + 0.25f * place.patch + 0.25f * place.clump), 0.130f, 0.140f, 0.052f);
  // Mown in bands.
  const Grid at = grid_of(place);
  const auto width_m = static_cast<double>(place.footprint_m);
  const double band = share_of_bars(at.across_m, width_m, 6.0, 12.0);
  shade(color, 0.95f + 0.10f * static_cast<float>(band) + 0.06f * feature_tint(bits));
  shade(color, clamped(1.0f + 0.06f * place.coarse + 0.12f * place.grain + 0.18f * place.fine, 0.4f,
                       1.7f));
  look = {.albedo = color, .openness = 0.90f};
}

void lay_sand(const PavedPlace& place, std::uint64_t bits, PavedLook& look) {
  Rgb color{0.420f, 0.350f, 0.245f};
  shade(color, 1.0f + 0.10f * feature_tint(bits) + 0.05f * place.coarse + 0.06f * place.clump +
                   0.06f * place.grain + 0.07f * place.fine);
  look = {.albedo = color, .openness = 0.96f};
}

/// Rubber that wheels leave where aircraft touch down: two broad bands, 150 m to 900 m behind either
/// threshold, densest at 400 m.
float rubber_share(const PavedPlace& place) {
  const world::PaintSample& paint = place.paint;
  if (paint.marking != Marking::Runway) return 0.0f;
  const double end_m = paint.whole_m - paint.unmarked_end_m;
  const double ahead_m = std::min(paint.along_m - paint.unmarked_start_m, end_m - paint.along_m);
  const auto ahead = static_cast<float>(ahead_m);
  const float along = ramp((ahead - 120.0f) / 250.0f) * ramp((950.0f - ahead) / 500.0f);
  const auto across = static_cast<float>(std::abs(paint.across_m));
  const float beside = absolute(across - 3.6f) / 3.4f;
  const float band = 1.0f / (1.0f + beside * beside * beside * beside);
  // Streaks along the runway.
  const float streak = told(place.footprint_m, 0.8f) *
                       (cell_tint(paint.coating.feature, std::floor(paint.across_m / 0.42),
                                  std::floor(paint.along_m / 55.0)) -
                        0.5f);
  return clamped(along * band * (0.62f + 0.35f * streak + 0.08f * place.coarse), 0.0f, 0.85f);
}

/// Paint: worn off by wheels and years, dirty.
void lay_marks(const PavedPlace& place, std::uint64_t bits, PavedLook& look) {
  const MarkCover cover = marks_within(place.paint, static_cast<double>(place.footprint_m));
  if (cover.share() <= 0.0) return;
  const float age = 0.5f + 0.5f * feature_tint(core::mix_bits(bits));
  const float flakes =
      told(place.footprint_m, 0.3f) * age * step_up(place.fine + 0.7f * place.grain - 0.9f, 0.6f);
  const float left =
      clamped(0.95f - 0.10f * age - 0.55f * flakes - 0.12f * wheel_share(place), 0.0f, 1.0f);
  const float tone =
      clamped(1.0f - 0.10f * age + 0.04f * place.clump + 0.03f * place.fine, 0.7f, 1.08f);
  lay(look.albedo, left * static_cast<float>(cover.white), 0.640f * tone, 0.635f * tone,
      0.610f * tone);
  lay(look.albedo, left * static_cast<float>(cover.yellow), 0.620f * tone, 0.400f * tone,
      0.040f * tone);
}

/// A stream of a step's width: dark between stones, white where it falls over them.
void lay_stream(const PavedPlace& place, PavedLook& look) {
  const float stones = step_up(place.grain + 0.6f * place.clump - 1.3f, 0.5f);
  const float white = 0.5f * step_up(place.fine + place.grain - 2.0f, 0.6f);
  const float tone = clamped(1.0f + 0.2f * place.clump, 0.6f, 1.4f);
  look.albedo = {0.030f * tone, 0.038f * tone, 0.030f * tone};
  lay(look.albedo, stones, 0.17f, 0.16f, 0.14f);
  lay(look.albedo, white, 0.55f, 0.58f, 0.60f);
  look.openness = 0.9f;
}

/// Earth and grass that creep in from the edge of a strip.
void lay_edge(const PavedPlace& place, PavedLook& look) {
  const world::PaintSample& paint = place.paint;
  if (paint.half_width_m <= 0.0 || paint.coating.paving == Paving::Ballast) return;
  const auto from_edge_m = static_cast<float>(paint.half_width_m - std::abs(paint.across_m));
  const float reach_m = 0.14f + 0.08f * place.grain + 0.06f * place.clump;
  const float soft_m = core::larger(0.06f, 0.5f * place.footprint_m);
  lay(look.albedo, 0.75f * step_up(reach_m - from_edge_m, soft_m), 0.135f, 0.115f, 0.075f);
}

}  // namespace

PavedLook look_at_paving(const PavedPlace& place, std::uint32_t seed) {
  const std::uint64_t bits = seed_of(place, seed);
  PavedLook look{};
  switch (place.paint.coating.paving) {
    case Paving::Asphalt:
      lay_asphalt(place, bits, look);
      break;
    case Paving::Concrete:
      lay_concrete(place, bits, look);
      break;
    case Paving::Cobbles:
      lay_cobbles(place, bits, look);
      break;
    case Paving::Gravel:
      lay_gravel(place, bits, look);
      break;
    case Paving::Earth:
      lay_earth(place, bits, look);
      break;
    case Paving::Ballast:
      lay_ballast(place, bits, look);
      break;
    case Paving::Grass:
      lay_grass(place, bits, look);
      break;
    case Paving::Sand:
      lay_sand(place, bits, look);
      break;
    case Paving::Water:
      lay_stream(place, look);
      break;
  }
  lay_marks(place, bits, look);
  lay(look.albedo, rubber_share(place), 0.022f, 0.022f, 0.023f);
  lay_edge(place, look);
  look.albedo = {clamped(look.albedo.r, 0.004f, 0.88f), clamped(look.albedo.g, 0.004f, 0.88f),
                 clamped(look.albedo.b, 0.004f, 0.88f)};
  return look;
}

float relief_of(world::Paving paving) {
  switch (paving) {
    case Paving::Asphalt:
    case Paving::Concrete:
      return 0.008f;
    case Paving::Cobbles:
    case Paving::Sand:
    case Paving::Water:
      return 0.035f;
    case Paving::Gravel:
    case Paving::Grass:
      return 0.06f;
    case Paving::Earth:
    case Paving::Ballast:
      return 0.09f;
  }
  return 0.0f;
}

}  // namespace terracast::scene
