#include "scene/ground/natural_cover.h"

#include <algorithm>
#include <cmath>

#include "core/packet_code.h"
#include "core/random.h"
#include "scene/ground/blend.h"
#include "scene/ground/pattern.h"

namespace terracast::scene {
namespace {

using core::larger;
using core::smaller;
using world::Cover;

/// Shares that follow slope, height, moisture and noise.
/// least_debris   what debris on steep ground is held back by below the tree line: by soil and roots, but not
///                where the ground is known to be bare
TERRACAST_PACKET_CODE void draw_natural(const GroundPacket& g, const Lanes<float>& least_debris,
                                        float snow_line, float tree_line, float beach, Covers& c) {
  for (int i = 0; i < kLanes; ++i) {
    const float region = c.region.value[i];
    const float patch = c.patch.value[i];
    const float clump = c.clump.value[i];
    // Edges are as soft as what the footprint left out of the noise that draws them.
    const float blur = 0.45f * c.patch.left_out[i] + 0.45f * c.clump.left_out[i];
    const float height = g.height_m[i];
    const float steep = g.steepness[i];
    const float moist = g.moisture[i];
    const float above_trees = height - tree_line - 60.0f * region;

    c.grass[i] = step_up((moist - 0.15f) * 3.0f + 0.40f * region + 0.35f * patch + 0.30f * clump -
                             2.0f * ramp((above_trees - 350.0f) / 500.0f),
                         0.55f + blur);
    c.field[i] =
        step_up(smaller((0.15f - steep) * 14.0f, 1.2f) + 0.45f * region -
                    3.0f * ramp((above_trees + 900.0f) / 200.0f),
                0.10f) *
        step_up(height - beach - 3.0f, 1.5f) *
        // Beyond the square a dry world says so by its moisture.
        (static_cast<Cover>(g.cover[i]) == Cover::Outside ? ramp((moist - 0.02f) / 0.04f) : 1.0f);
    c.forest[i] = step_up(
        (moist - 0.40f) * 2.0f + 0.60f * region + 0.55f * patch + 0.40f * clump +
            1.2f * ramp((steep - 0.12f) * 2.5f) - 0.25f - 4.0f * ramp(above_trees / 160.0f) -
            3.0f * ramp((steep - 0.66f) * 6.0f) - 3.0f * ramp((beach + 4.0f - height) / 4.0f),
        0.16f + blur);
    c.sand[i] = step_up(beach - height + 0.7f * patch + 0.4f * clump, 0.5f + blur) *
                step_up(0.30f - steep, 0.08f);
    c.scree[i] = step_up((steep - 0.50f) / 0.12f + 0.55f * patch + 0.30f * clump +
                             clamped(above_trees / 300.0f, least_debris[i], 0.6f),
                         0.30f + blur);
    c.rock[i] = step_up((steep - 0.64f) / 0.10f + 0.50f * patch + 0.60f * clump +
                            clamped(above_trees / 900.0f, -0.3f, 0.9f),
                        0.22f + blur);
    // Snow slides off the steep, into gullies, where it lies longest.
    const float gully = gully_of(moist) * ramp((steep - 0.35f) * 5.0f);
    c.snow[i] = step_up((height - snow_line) / 260.0f + 0.35f * region + 0.40f * patch +
                            0.35f * clump + 1.4f * g.northness[i] + 1.5f * gully -
                            5.0f * larger(0.0f, steep - 0.60f - 0.12f * gully),
                        0.14f + blur);
  }
}

/// A colour of cultivated land, its rows, and how far from a balk.
struct Parcel {
  Rgb color;
  float bare;  ///< share of tracks through the crop
  float edge_m;
};

/// How a crop looks from above where plants can no longer be told from each other, and its rows.
struct CropLook {
  Rgb color;
  double row_m;        ///< apart; 0: none are seen
  double plant_share;  ///< of a row that its plants cover
  Rgb between;         ///< the ground between rows
  bool has_tracks;     ///< of the sprayer: two of 0.4 m every 18 m
  bool has_plants;     ///< stand on the ground themselves where they are seen one by one
};

const CropLook& look_of(world::Crop crop) {
  static constexpr Rgb kSoil{0.150f, 0.108f, 0.070f};
  static constexpr Rgb kLitter{0.200f, 0.155f, 0.085f};
  static constexpr std::array<CropLook, world::kNumCrops> kLooks = {{
      {{0.145f, 0.104f, 0.070f},
       1.5,
       0.5,
       {0.128f, 0.092f, 0.062f},
       false,
       false},                                                    // fallow: tilled
      {{0.066f, 0.102f, 0.026f}, 0.8, 0.75, kSoil, true, true},   // corn
      {{0.272f, 0.208f, 0.094f}, 0.0, 1.0, kLitter, true, true},  // wheat
      {{0.056f, 0.084f, 0.026f}, 2.0, 0.45, kSoil, false, true},  // vine
      {{0.070f, 0.116f, 0.034f}, 0.5, 0.80, kSoil, true, false},  // beets
      {{0.200f, 0.190f, 0.055f}, 0.0, 1.0, kSoil, true, false},   // rape
      {{0.080f, 0.118f, 0.034f}, 0.0, 1.0, kSoil, false, false},  // clover
      {{0.285f, 0.236f, 0.132f}, 6.0, 0.5, {0.262f, 0.214f, 0.116f}, false, false}  // stubble
  }};
  return kLooks[static_cast<std::size_t>(crop)];
}

/// stands   crops stand on the ground as things where they are near
Parcel parcel_of(const world::FieldPattern::Place& field, float footprint, bool stands) {
  const CropLook& crop = look_of(field.crop);
  const auto footprint_m = static_cast<double>(footprint);
  Parcel parcel;
  parcel.color = crop.color;
  const auto part = [&](int shift) {
    return static_cast<float>((field.key >> shift) & 255u) / 255.0f - 0.5f;
  };
  shade(parcel.color, 1.0f + 0.30f * part(8));
  parcel.color.r *= 1.0f + 0.12f * part(24);
  parcel.color.b *= 1.0f - 0.12f * part(24);
  float open = 0.0f;  // share of ground that is seen between plants
  if (crop.row_m > 0.0)
    open = 1.0f - static_cast<float>(share_of_bars(field.across_m, footprint_m,
                                                   crop.plant_share * crop.row_m, crop.row_m));
  if (stands && crop.has_plants)
    open = core::larger(open, 1.0f - ramp((footprint - 0.15f) / 0.25f));
  lay(parcel.color, open, crop.between);
  const double tracks = share_of_bars(field.across_m - 8.0, footprint_m, 0.4, 18.0) +
                        share_of_bars(field.across_m - 9.8, footprint_m, 0.4, 18.0);
  parcel.bare = crop.has_tracks ? static_cast<float>(tracks) : 0.0f;
  parcel.edge_m = static_cast<float>(field.edge_m);
  return parcel;
}

/// A meadow's colour, and what stands out of it in patches.
struct Meadow {
  Rgb color;
  float flowers;    ///< how many
  float are_white;  ///< 1: daisies and parsley, 0: buttercups and dandelions
  float tussocks;   ///< that cattle leave
};

/// Meadows and pastures: grown, mown, made into hay, eaten short; each in swaths of its mower, some with the wheels'
/// tracks.
Meadow meadow_of(const world::FieldPattern::Place& holding, float footprint_m) {
  struct State {
    Rgb color;
    float swaths;
    float tracks;
    float flowers;
    float tussocks;
  };
  static constexpr State kStates[6] = {{{0.072f, 0.116f, 0.030f}, 0.05f, 0.5f, 0.4f, 0.0f},
                                       {{0.112f, 0.128f, 0.044f}, 0.04f, 0.0f, 1.0f, 0.0f},
                                       {{0.186f, 0.172f, 0.078f}, 0.18f, 0.3f, 0.0f, 0.0f},
                                       {{0.080f, 0.104f, 0.036f}, 0.02f, 0.0f, 0.3f, 1.0f},
                                       {{0.122f, 0.150f, 0.046f}, 0.18f, 0.4f, 0.0f, 0.0f},
                                       {{0.062f, 0.092f, 0.028f}, 0.02f, 0.0f, 0.0f, 0.8f}};
  const State& state = kStates[holding.key % 6];
  const auto width_m = static_cast<double>(footprint_m);
  Meadow meadow{.color = state.color,
                .flowers = state.flowers * static_cast<float>((holding.key >> 16) & 255u) / 255.0f,
                .are_white = ((holding.key >> 24) & 3u) == 0 ? 1.0f : 0.0f,
                .tussocks = state.tussocks};
  Rgb& color = meadow.color;
  shade(color, 0.90f + 0.20f * static_cast<float>((holding.key >> 8) & 255u) / 255.0f);
  const double swath = share_of_bars(holding.across_m, width_m, 3.0, 6.0);
  shade(color, 1.0f + state.swaths * (static_cast<float>(swath) - 0.5f));
  const double tracks = share_of_bars(holding.across_m - 5.0, width_m, 0.45, 24.0) +
                        share_of_bars(holding.across_m - 6.8, width_m, 0.45, 24.0);
  lay(color, state.tracks * static_cast<float>(tracks), 0.150f, 0.132f, 0.076f);
  // Along fences and ditches nobody mows: 1.5 m to each side, thinned to its share of the footprint.
  const float reach = larger(1.5f, footprint_m);
  const float verge =
      (1.5f / reach) * step_up(reach - static_cast<float>(holding.edge_m), 0.5f * reach);
  lay(color, 0.7f * verge, 0.062f, 0.082f, 0.030f);
  return meadow;
}

/// Yards of towns: blocks of about 200 m turn them their own way; lawns, beds, paving, gravel and asphalt in
/// cells of 7 to 16 m.
Rgb yard_at(const NoisePlaces& places, int lane, float clump, float grain, std::uint32_t seed) {
  const int block_shift = 20;  // 256 m
  const std::uint64_t block =
      core::random_bits(seed + 5, static_cast<std::uint32_t>(places.u[0][lane] >> block_shift),
                        static_cast<std::uint32_t>(places.v[0][lane] >> block_shift));
  const int plane = static_cast<int>(block % kNumNoisePlanes);
  const double along_m = places.u[plane][lane] * kNoiseStep_m;
  const double across_m = places.v[plane][lane] * kNoiseStep_m;
  const double width_m = 7.0 + 9.0 * static_cast<double>((block >> 8) & 255u) / 255.0;
  const double row = std::floor(across_m / width_m);
  const double length_m = width_m * (0.8 + 0.8 * static_cast<double>(cell_tint(block, 1, row)));
  const double column = std::floor(along_m / length_m);
  const float kind = cell_tint(block, column, row);
  const float tint = 0.85f + 0.30f * cell_tint(block ^ 7, column, row);
  const float footprint_m = places.footprint_m[lane];
  Rgb color{0.190f, 0.181f, 0.166f};  // paving
  if (kind < 0.46f) {
    color = {0.070f, 0.105f, 0.030f};  // lawn
    lay(color, ramp(0.4f + 0.3f * clump), 0.120f, 0.130f, 0.050f);
  } else if (kind < 0.58f) {
    color = {0.095f, 0.075f, 0.048f};  // beds
    lay(color, ramp(0.3f + 0.6f * grain), 0.050f, 0.068f, 0.024f);
  } else if (kind < 0.66f) {
    color = {0.225f, 0.207f, 0.176f};  // gravel
  } else if (kind < 0.76f) {
    color = {0.098f, 0.097f, 0.096f};  // asphalt
  }
  shade(color, tint * (1.0f + 0.05f * clump + 0.06f * grain));
  const double edge =
      share_of_joints(along_m, across_m, static_cast<double>(footprint_m), 0.25, length_m, width_m);
  lay(color, 0.6f * static_cast<float>(edge), 0.150f, 0.142f, 0.128f);
  // What cells mix to where a sample covers many.
  lay(color, 1.0f - told(footprint_m, 2.0f * static_cast<float>(width_m)), 0.121f, 0.130f, 0.086f);
  return color;
}

/// Rock: formations of hundreds of metres, fresh and grey or weathered and warm; dark and pale beds in them,
/// clear here and hardly seen there; scars of rockfalls; gullies, dark where they are walls and pale with debris
/// where they are not; cracks where the noise passes zero, lichen. Thresholds lie so that the mean does not
/// change with what the footprint leaves out.
TERRACAST_PACKET_INLINE Rgb rock_of(const Covers& c, const Details& d, int i, float gully,
                                    float steepness) {
  const float patch = c.patch.value[i];
  const float clump = c.clump.value[i];
  const float bed = d.strata.value[i];
  const float lost_bed = d.strata.left_out[i];
  const float bedding = bedding_of(c.region.value[i]);

  Rgb rock{0.188f, 0.186f, 0.182f};
  lay(rock, ramp(0.5f + 0.50f * d.formation.value[i] + 0.12f * patch), 0.312f, 0.270f, 0.214f);
  lay(rock, (0.15f + 0.60f * bedding) * step_up(-bed - 0.75f, 0.40f + 1.60f * lost_bed), 0.128f,
      0.123f, 0.118f);
  lay(rock, (0.10f + 0.55f * bedding) * step_up(bed - 0.85f, 0.35f + 1.66f * lost_bed), 0.372f,
      0.348f, 0.308f);
  shade(rock, 1.0f + (0.03f + 0.07f * bedding) * bed + 0.06f * patch + 0.06f * clump);
  const float scar = step_up(patch + 0.5f * clump - 1.7f,
                             0.35f + 1.4f * (c.patch.left_out[i] + 0.5f * c.clump.left_out[i]));
  lay(rock, 0.55f * scar, 0.340f, 0.305f, 0.268f);

  const float wall = ramp((steepness - 0.66f) * 8.0f);
  shade(rock, 1.0f - 0.42f * gully * wall);
  lay(rock, 0.75f * gully * (1.0f - wall), 0.300f, 0.284f, 0.258f);

  const float open = 1.0f - d.cracks.left_out[i];
  const float nearness = 1.0f - smaller(absolute(d.cracks.value[i]) * 6.0f, 1.0f);
  shade(rock, 1.0f - 0.45f * open * nearness);
  const float lichen = step_up(0.5f * d.coarse.value[i] + 0.7f * patch - 0.4f,
                               0.5f + 0.6f * d.coarse.left_out[i] + 0.7f * c.patch.left_out[i]);
  lay(rock, 0.22f * lichen, 0.150f, 0.156f, 0.118f);
  return rock;
}

/// Parcels and yards, picked one by one before the arithmetic that is the same for all lanes; and rock, which many
/// packets have none of.
struct Plots {
  Lanes<float> parcel_r, parcel_g, parcel_b, parcel_edge_m, parcel_bare;
  Lanes<float> meadow_r, meadow_g, meadow_b, flowers, are_white, tussocks;
  Lanes<float> yard_r, yard_g, yard_b;
  Lanes<float> rock_r, rock_g, rock_b;
};

TERRACAST_PACKET_CODE void paint_rock(const GroundPacket& g, const Covers& c, const Details& d,
                                      float tree_line_m, Plots& p) {
  for (int i = 0; i < kLanes; ++i) {
    const float patch = c.patch.value[i];
    const float clump = c.clump.value[i];
    Rgb rock = rock_of(c, d, i, gully_of(g.moisture[i]), g.steepness[i]);
    // Grass on ledges, which follow the layers: less where it is steeper, none high above the trees.
    const float ledge = step_up(0.7f * d.strata.value[i] + 0.45f * patch + 0.30f * clump +
                                    6.0f * (0.72f - g.steepness[i]) - 0.45f,
                                0.25f + 0.95f * d.strata.left_out[i] + 0.35f * c.patch.left_out[i] +
                                    0.25f * c.clump.left_out[i]);
    lay(rock, 0.8f * ledge * (1.0f - ramp((g.height_m[i] - tree_line_m - 100.0f) / 500.0f)), 0.092f,
        0.104f, 0.044f);
    p.rock_r[i] = rock.r;
    p.rock_g[i] = rock.g;
    p.rock_b[i] = rock.b;
  }
}

TERRACAST_PACKET_CODE void paint(const GroundPacket& g, const Covers& c, const Details& d,
                                 const Plots& p, const Lanes<float>& relief, float tree_line_m,
                                 GroundLook& look) {
  for (int i = 0; i < kLanes; ++i) {
    const float region = c.region.value[i];
    const float patch = c.patch.value[i];
    const float clump = c.clump.value[i];
    const float moist = g.moisture[i];
    const float high = ramp((g.height_m[i] - tree_line_m + 400.0f) / 800.0f);
    const float footprint = g.places.footprint_m[i];

    // Soil, then grass from straw to green by moisture.
    Rgb color{0.165f, 0.118f, 0.072f};
    lay(color, ramp(0.4f + 0.25f * patch), 0.215f, 0.172f, 0.115f);
    const float green = ramp(0.48f + 1.2f * (moist - 0.35f) + 0.22f * region + 0.20f * patch +
                             0.16f * clump + 0.12f * d.coarse.value[i]);
    Rgb grass{0.185f, 0.155f, 0.065f};
    lay(grass, green, 0.070f, 0.098f, 0.028f);
    lay(grass, 0.50f * high, 0.115f, 0.126f, 0.052f);
    // Meadows: mown ones bright, tall ones with seed heads, clover and flowers in patches.
    // On slopes and above the fields they are pastures without borders.
    const float wild = ramp((g.steepness[i] - 0.20f) * 6.0f + high);
    Rgb meadow{0.092f, 0.116f, 0.036f};
    lay(meadow, ramp(0.40f + 0.30f * patch + 0.25f * region), 0.128f, 0.132f, 0.052f);
    lay(meadow, 1.0f - wild, p.meadow_r[i], p.meadow_g[i], p.meadow_b[i]);
    // Lush in hollows, thin and pale on dry ground.
    lay(meadow, 0.45f * ramp(3.0f * (moist - 0.45f) + 0.10f * patch), 0.050f, 0.082f, 0.026f);
    lay(meadow, 0.45f * ramp(3.0f * (0.28f - moist) + 0.15f * patch), 0.150f, 0.138f, 0.066f);
    lay(meadow, 0.25f * ramp(0.15f + 0.30f * patch + 0.12f * clump), 0.150f, 0.140f, 0.064f);
    // Where cattle dunged they leave tussocks, a metre wide.
    const float tussock = step_up(0.8f * d.stones.value[i] + 0.6f * d.grain.value[i] - 1.0f,
                                  0.35f + 1.1f * d.stones.left_out[i] + 0.6f * d.grain.left_out[i]);
    lay(meadow, 0.55f * p.tussocks[i] * (1.0f - wild) * tussock, 0.040f, 0.070f, 0.020f);
    const float flowers = p.flowers[i] * (1.0f - wild) *
                          ramp(0.35f + 0.40f * patch + 0.25f * clump) *
                          ramp(0.7f + 0.45f * d.fine.value[i] + 0.25f * d.stones.value[i]);
    lay(meadow, 0.30f * flowers, 0.340f, 0.280f + 0.06f * p.are_white[i],
        0.040f + 0.26f * p.are_white[i]);
    lay(meadow, 0.35f * ramp(d.grain.value[i] + 0.5f * clump - 1.3f), 0.240f, 0.220f, 0.105f);
    lay(grass, c.meadow[i], meadow);
    // Wetland: sedges, brown moss, dark pools.
    Rgb fen{0.082f, 0.088f, 0.036f};
    lay(fen, ramp(0.4f + 0.5f * clump), 0.115f, 0.088f, 0.045f);
    const float pool = step_up(0.7f * patch + 0.55f * clump + 0.25f * d.coarse.value[i] - 0.75f,
                               0.12f + 0.5f * c.clump.left_out[i]);
    lay(fen, 0.92f * pool, 0.016f, 0.020f, 0.017f);
    lay(grass, c.wet[i], fen);
    lay(color, c.grass[i], grass);

    // Litter, moss and roots below trees; bushes over grass and bare earth.
    Rgb floor{0.078f, 0.056f, 0.034f};
    lay(floor, ramp(0.35f + 0.40f * clump + 0.25f * patch), 0.050f, 0.062f, 0.024f);
    lay(floor, 0.6f * ramp(0.7f * d.grain.value[i] - 0.3f), 0.120f, 0.090f, 0.058f);
    lay(color, c.floor[i], floor);
    const float bush =
        step_up(d.bushes.value[i] + 0.35f * patch - 0.15f, 0.35f + 0.8f * d.bushes.left_out[i]);
    Rgb leaves{0.040f, 0.056f, 0.020f};
    lay(leaves, ramp(0.4f + 0.35f * clump), 0.078f, 0.086f, 0.034f);
    shade(leaves, 1.0f + 0.30f * ramp(0.5f * d.bushes.value[i]));
    lay(color, c.shrubs[i] * bush, leaves);
    lay(color, c.built[i], p.yard_r[i], p.yard_g[i], p.yard_b[i]);

    const float furrows = 1.0f + 0.05f * d.coarse.value[i] + 0.09f * patch;
    lay(color, c.field[i], p.parcel_r[i] * furrows, p.parcel_g[i] * furrows,
        p.parcel_b[i] * furrows);
    lay(color, 0.8f * c.field[i] * p.parcel_bare[i], 0.150f, 0.112f, 0.072f);
    // Grass on the balks, 1.8 m to each side of the edge, thinned to its share of the footprint.
    const float reach = larger(1.8f, footprint);
    const float balk = (1.8f / reach) * step_up(reach - p.parcel_edge_m[i], 0.5f * reach) *
                       ramp(0.8f + 0.5f * clump);
    Rgb weeds{0.088f, 0.104f, 0.040f};
    lay(weeds, ramp(0.4f + 0.5f * clump), 0.135f, 0.128f, 0.058f);
    lay(color, c.field[i] * balk, weeds);

    // Crowns: bright tops, dark gaps.
    const float crown = ramp(0.5f + 0.42f * d.trees.value[i]);
    const float broadleaf = ramp(0.5f + 0.5f * region + 0.5f * patch - 1.2f * high);
    Rgb forest{0.030f, 0.045f, 0.020f};
    lay(forest, broadleaf, 0.058f, 0.078f, 0.026f);
    shade(forest, (0.35f + 1.30f * crown) * (1.0f + 0.18f * d.coarse.value[i] + 0.10f * clump));
    lay(color, c.forest[i], forest);

    // Sand, wet and half as bright where waves run up it.
    Rgb sand{0.40f, 0.335f, 0.235f};
    const float wet = step_up(0.55f - g.height_m[i] + 0.20f * clump + 0.15f * patch, 0.35f);
    lay(sand, wet, 0.195f, 0.155f, 0.105f);
    lay(color, c.sand[i], sand);

    // Debris below the faces: fresh and pale where gullies leave it, with lichen and some grass beside.
    const float gully = gully_of(moist);
    Rgb scree{0.232f, 0.221f, 0.200f};
    lay(scree, gully, 0.325f, 0.308f, 0.280f);
    shade(scree, 1.0f + 0.12f * patch + 0.10f * clump);
    lay(color, c.scree[i], scree);

    lay(color, c.rock[i], p.rock_r[i], p.rock_g[i], p.rock_b[i]);

    // Grain of every scale, stones that stand out, less on snow.
    const float bare = larger(
        larger(c.rock[i], c.scree[i]),
        1.0f - larger(larger(c.grass[i], 0.8f * c.field[i]), larger(c.floor[i], c.built[i])));
    const float tended = larger(c.built[i], larger(0.6f * c.meadow[i], 0.45f * c.field[i]));
    // Debris is of one grain, and rock has beds in the place of what is coarse.
    const float rocky = c.rock[i];
    const float grainy = (0.17f + 0.08f * larger(bare - c.scree[i] * (1.0f - rocky), 0.0f)) *
                         (1.0f - 0.6f * tended) * (1.0f - 0.35f * c.scree[i] * (1.0f - rocky));
    // Grass grows over what lies below it: it is of a fine grain, too.
    const float grown = larger(c.meadow[i], c.field[i]);
    const float mottle =
        1.0f +
        grainy * ((1.0f - 0.65f * rocky) * (1.0f - 0.65f * grown) * d.coarse.value[i] +
                  (1.0f - 0.35f * grown) * d.grain.value[i] + d.fine.value[i]) +
        0.07f * (1.0f - 0.5f * rocky) * (1.0f - 0.5f * grown) * clump;
    shade(color, clamped(mottle, 0.30f, 1.9f));
    const float stony = bare * (1.0f - c.forest[i]) * (1.0f - d.stones.left_out[i]);
    shade(color, 1.0f + 0.55f * stony * step_up(d.stones.value[i] - 1.15f, 0.30f) -
                     0.35f * stony * step_up(-d.stones.value[i] - 1.25f, 0.30f));

    lay(color, c.snow[i], d.snow[0][i], d.snow[1][i], d.snow[2][i]);

    look.albedo[0][i] = clamped(color.r, 0.004f, 0.88f);
    look.albedo[1][i] = clamped(color.g, 0.004f, 0.88f);
    look.albedo[2][i] = clamped(color.b, 0.004f, 0.88f);
    const float hollow = 0.10f * (d.coarse.value[i] + d.grain.value[i]) * relief[i] * 5.0f +
                         0.25f * c.forest[i] * (crown - 0.5f) -
                         0.15f * c.shrubs[i] * (0.5f - bush) - 0.10f * c.floor[i];
    look.openness[i] = clamped(0.90f + hollow, 0.45f, 1.0f);
    look.is_water[i] = 0.0f;
    look.wave_variance[i] = 0.0f;
  }
}

bool any(const Lanes<float>& lanes) {
  return *std::max_element(lanes.values, lanes.values + kLanes) > 0.0f;
}

}  // namespace

void guess_covers(const GroundPacket& packet, const Climate& climate, Covers& covers) {
  Lanes<float> least_debris;
  for (int i = 0; i < kLanes; ++i)
    least_debris[i] = static_cast<Cover>(packet.cover[i]) == Cover::Bare ? -0.3f : -3.0f;
  draw_natural(packet, least_debris, static_cast<float>(climate.snow_line_m),
               static_cast<float>(climate.tree_line_m), climate.has_sea ? 1.8f : -1e6f, covers);
  for (Lanes<float>* lanes :
       {&covers.shrubs, &covers.floor, &covers.meadow, &covers.built, &covers.wet})
    std::fill_n(lanes->values, kLanes, 0.0f);
}

void take_known_covers(const GroundPacket& g, const Climate& climate, Covers& c) {
  for (int i = 0; i < kLanes; ++i) {
    const auto cover = static_cast<Cover>(g.cover[i]);
    if (cover == Cover::Land || cover == Cover::Sea || cover == Cover::Outside) continue;
    const auto if_it_is = [&](Cover one) { return cover == one ? 1.0f : 0.0f; };
    // The steeper it is the less a town paves, half of it at 15 degrees: there are gardens, thickets.
    const float town = if_it_is(Cover::BuiltUp);
    const float gardens = town * ramp(7.0f * (g.steepness[i] - 0.19f) + 0.35f * c.clump.value[i]);
    const float forest = if_it_is(Cover::Forest);
    const float shrubs = if_it_is(Cover::Shrubs) + gardens;
    const float meadow = if_it_is(Cover::Grass);
    const float bare = if_it_is(Cover::Bare);
    // Where trees stand on the ground it is their floor that is seen; so far off that a tree is less
    // than a sample, they are not there, and the ground looks like their crowns.
    const float crowns = climate.has_trees ? ramp((g.places.footprint_m[i] - 8.0f) / 12.0f) : 1.0f;
    c.wet[i] = if_it_is(Cover::Wetland);
    c.meadow[i] = meadow;
    c.grass[i] = meadow + c.wet[i] +
                 shrubs * ramp(0.35f + 0.4f * c.clump.value[i] + 0.3f * c.patch.value[i]);
    c.field[i] = if_it_is(Cover::Crops);
    c.forest[i] = forest * crowns;
    c.floor[i] = forest * (1.0f - crowns);
    c.shrubs[i] = shrubs;
    c.built[i] = town - gardens;
    c.sand[i] *= bare;
    c.scree[i] *= bare + 0.5f * (meadow + shrubs);
    c.rock[i] *= bare + 0.7f * (meadow + shrubs + forest);
    c.snow[i] = larger(c.snow[i] * (bare + meadow), if_it_is(Cover::Snow));
  }
}

void paint_land(const GroundPacket& packet, const Covers& covers, const Details& details,
                const Lanes<float>& relief, const Climate& climate, GroundLook& look) {
  Plots plots{};
  for (int i = 0; i < kLanes; ++i) {
    const Eigen::Vector2d place(packet.east_m[i], packet.north_m[i]);
    if (covers.meadow[i] > 0.0f) {
      const Meadow meadow =
          meadow_of(climate.fields.at(place, Cover::Grass), packet.places.footprint_m[i]);
      plots.meadow_r[i] = meadow.color.r;
      plots.meadow_g[i] = meadow.color.g;
      plots.meadow_b[i] = meadow.color.b;
      plots.flowers[i] = meadow.flowers;
      plots.are_white[i] = meadow.are_white;
      plots.tussocks[i] = meadow.tussocks;
    }
    if (covers.field[i] > 0.0f) {
      const Parcel parcel = parcel_of(climate.fields.at(place, Cover::Crops),
                                      packet.places.footprint_m[i], climate.has_trees);
      plots.parcel_r[i] = parcel.color.r;
      plots.parcel_g[i] = parcel.color.g;
      plots.parcel_b[i] = parcel.color.b;
      plots.parcel_edge_m[i] = parcel.edge_m;
      plots.parcel_bare[i] = parcel.bare;
    }
    if (covers.built[i] > 0.0f) {
      const Rgb yard =
          yard_at(packet.places, i, covers.clump.value[i], details.grain.value[i], climate.seed);
      plots.yard_r[i] = yard.r;
      plots.yard_g[i] = yard.g;
      plots.yard_b[i] = yard.b;
    }
  }
  const auto tree_line_m = static_cast<float>(climate.tree_line_m);
  if (any(covers.rock)) paint_rock(packet, covers, details, tree_line_m, plots);
  paint(packet, covers, details, plots, relief, tree_line_m, look);
}

}  // namespace terracast::scene
