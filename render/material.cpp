#include "render/material.h"

#include <algorithm>
#include <cmath>

#include "core/packet_code.h"
#include "core/random.h"
#include "world/climate.h"

namespace terracast::render {
namespace {

using core::larger;
using core::smaller;

constexpr double kEarthRadius_m = 6371008.8;

TERRACAST_PACKET_INLINE double height_over_sphere_m(double x, double y, double z) {
  return z + (x * x + y * y) * (0.5 / kEarthRadius_m);
}

TERRACAST_PACKET_INLINE float absolute(float a) { return a < 0.0f ? -a : a; }
TERRACAST_PACKET_INLINE float clamped(float x, float lowest, float highest) {
  return smaller(larger(x, lowest), highest);
}
/// 0 below -width, 1 above width, smooth between.
TERRACAST_PACKET_INLINE float step_up(float x, float width) {
  const float t = clamped(0.5f + 0.5f * x / width, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}
/// 0 below 0, linear to 1 at 1.
TERRACAST_PACKET_INLINE float ramp(float x) { return clamped(x, 0.0f, 1.0f); }

/// Streams of noise; each idea has its own.
constexpr std::uint32_t kRegion = 11;
constexpr std::uint32_t kPatch = 23;
constexpr std::uint32_t kClump = 37;
constexpr std::uint32_t kTrees = 41;
constexpr std::uint32_t kCoarseGrain = 53;
constexpr std::uint32_t kGrain = 67;
constexpr std::uint32_t kFineGrain = 79;
constexpr std::uint32_t kStrata = 83;
constexpr std::uint32_t kCracks = 97;
constexpr std::uint32_t kStones = 101;
constexpr std::uint32_t kWaves = 113;
constexpr std::uint32_t kFieldWarp = 127;

/// Shares of the ground's covers at a packet, each over all that is listed before it.
struct Covers {
  Lanes<float> grass;
  Lanes<float> field;
  Lanes<float> forest;
  Lanes<float> sand;
  Lanes<float> scree;
  Lanes<float> rock;
  Lanes<float> snow;
  NoiseSum region;  ///< 4 km to 256 m
  NoiseSum patch;   ///< 128 to 32 m
  NoiseSum clump;   ///< 16 to 1 m
};

TERRACAST_PACKET_CODE void draw_covers(const GroundPacket& g, float snow_line, float tree_line,
                                       float beach, Covers& c) {
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
    c.field[i] = step_up(smaller((0.15f - steep) * 14.0f, 1.2f) + 0.45f * region -
                             3.0f * ramp((above_trees + 900.0f) / 200.0f),
                         0.10f) *
                 step_up(height - beach - 3.0f, 1.5f);
    c.forest[i] = step_up(
        (moist - 0.40f) * 2.0f + 0.60f * region + 0.55f * patch + 0.40f * clump +
            1.2f * ramp((steep - 0.12f) * 2.5f) - 0.25f - 4.0f * ramp(above_trees / 160.0f) -
            3.0f * ramp((steep - 0.66f) * 6.0f) - 3.0f * ramp((beach + 4.0f - height) / 4.0f),
        0.16f + blur);
    c.sand[i] = step_up(beach - height + 0.7f * patch + 0.4f * clump, 0.5f + blur) *
                step_up(0.30f - steep, 0.08f);
    c.scree[i] = step_up((steep - 0.50f) / 0.12f + 0.55f * patch + 0.30f * clump +
                             clamped(above_trees / 300.0f, -3.0f, 0.6f),
                         0.30f + blur);
    c.rock[i] = step_up((steep - 0.64f) / 0.10f + 0.50f * patch + 0.60f * clump +
                            clamped(above_trees / 900.0f, -0.3f, 0.9f),
                        0.22f + blur);
    c.snow[i] =
        step_up((height - snow_line) / 260.0f + 0.35f * region + 0.40f * patch + 0.35f * clump +
                    1.4f * g.northness[i] - 5.0f * larger(0.0f, steep - 0.60f),
                0.14f + blur);
  }
}

/// sum   sum_noise for what samples see, sum_all_noise for what is at their points
template <class Sum>
void spread_covers(const GroundPacket& g, const Climate& climate, const Sum& sum, Covers& c) {
  c.region = sum(g.places, 12, 8, climate.seed + kRegion);
  c.patch = sum(g.places, 7, 5, climate.seed + kPatch);
  c.clump = sum(g.places, 4, 0, climate.seed + kClump);
  draw_covers(g, static_cast<float>(climate.snow_line_m), static_cast<float>(climate.tree_line_m),
              climate.has_sea ? 1.8f : -1e6f, c);
}

/// All of a packet but its noise places and covers.
TERRACAST_PACKET_CODE void set_ground(const GroundPlaces& places, double sea_level_m,
                                      GroundPacket& __restrict packet) {
  const Lanes<double>& x = places.point_world[0];
  const Lanes<double>& y = places.point_world[1];
  const Lanes<double>& z = places.point_world[2];
  const Lanes<double>& nx = places.normal_world[0];
  const Lanes<double>& ny = places.normal_world[1];
  const Lanes<double>& nz = places.normal_world[2];
  // Layers of rock dip by a few degrees and run on for 8 times their thickness' scale.
  Lanes<double> across_m, along_m;
  for (int i = 0; i < kLanes; ++i) {
    across_m[i] = z[i] + 0.11 * x[i] - 0.07 * y[i];
    along_m[i] = 0.125 * (0.6 * x[i] + 0.8 * y[i]);
  }
  count_steps(across_m, packet.strata_u);
  count_steps(along_m, packet.strata_v);
  Lanes<double> steepness, height_m;
  for (int i = 0; i < kLanes; ++i) {
    const double up_x = x[i] * (1.0 / kEarthRadius_m);
    const double up_y = y[i] * (1.0 / kEarthRadius_m);
    const double up_squared = up_x * up_x + up_y * up_y + 1.0;
    const double along_up = nx[i] * up_x + ny[i] * up_y + nz[i];
    const double cosine_squared = larger(along_up, 0.0) * larger(along_up, 0.0) / up_squared;
    steepness[i] = std::sqrt(larger(1.0 - cosine_squared, 0.0));
    height_m[i] = height_over_sphere_m(x[i], y[i], z[i]) - sea_level_m;
  }
  for (int i = 0; i < kLanes; ++i) {
    packet.normal[0][i] = static_cast<float>(nx[i]);
    packet.normal[1][i] = static_cast<float>(ny[i]);
    packet.normal[2][i] = static_cast<float>(nz[i]);
    packet.steepness[i] = static_cast<float>(steepness[i]);
    packet.northness[i] = static_cast<float>(ny[i]);
    packet.height_m[i] = static_cast<float>(height_m[i]);
    packet.moisture[i] = static_cast<float>(places.moisture[i]);
    packet.spacing_m[i] = static_cast<float>(places.spacing_m[i]);
  }
}

/// A colour of cultivated land, and how far from a hedge.
struct Parcel {
  float color[3];
  float edge_m;
};

/// Patchwork of parcels: districts of about 1 km turn it their own way; in each, rows of 50 to 110
/// m are cut at 80 to 240 m.
Parcel parcel_at(const NoisePlaces& places, int lane, float warp_m, std::uint32_t seed) {
  const std::int32_t u0 = places.u[0][lane];
  const std::int32_t v0 = places.v[0][lane];
  const int district_shift = 22;  // 1024 m
  const std::uint64_t district =
      core::random_bits(seed, static_cast<std::uint32_t>(u0 >> district_shift),
                        static_cast<std::uint32_t>(v0 >> district_shift));
  const int plane = static_cast<int>(district % kNumNoisePlanes);
  const float width_m = 50.0f + 60.0f * static_cast<float>((district >> 8) & 255u) / 255.0f;
  const float length_m = 80.0f + 160.0f * static_cast<float>((district >> 16) & 255u) / 255.0f;
  const double along_m = places.u[plane][lane] * kNoiseStep_m + static_cast<double>(warp_m);
  const double across_m = places.v[plane][lane] * kNoiseStep_m - 0.7 * static_cast<double>(warp_m);
  const double row = std::floor(across_m / static_cast<double>(width_m));
  const float in_row_m = static_cast<float>(across_m - row * static_cast<double>(width_m));
  const std::uint64_t row_bits =
      core::random_bits(district, 1, static_cast<std::uint64_t>(static_cast<std::int64_t>(row)));
  const double shifted_m =
      along_m + static_cast<double>(length_m) * static_cast<double>(row_bits & 1023u) / 1024.0;
  const double column = std::floor(shifted_m / static_cast<double>(length_m));
  const float in_column_m = static_cast<float>(shifted_m - column * static_cast<double>(length_m));
  const std::uint64_t bits =
      core::random_bits(row_bits, 2, static_cast<std::uint64_t>(static_cast<std::int64_t>(column)));

  static constexpr float kCrops[8][3] = {{0.260f, 0.200f, 0.085f}, {0.075f, 0.120f, 0.032f},
                                         {0.140f, 0.100f, 0.066f}, {0.300f, 0.250f, 0.130f},
                                         {0.105f, 0.135f, 0.042f}, {0.055f, 0.090f, 0.026f},
                                         {0.190f, 0.165f, 0.070f}, {0.120f, 0.110f, 0.055f}};
  Parcel parcel;
  const float tint = 0.82f + 0.36f * static_cast<float>((bits >> 8) & 255u) / 255.0f;
  for (int k = 0; k < 3; ++k) parcel.color[k] = kCrops[bits % 8][k] * tint;
  parcel.edge_m =
      smaller(smaller(in_row_m, width_m - in_row_m), smaller(in_column_m, length_m - in_column_m));
  return parcel;
}

struct Rgb {
  float r, g, b;
};
/// Lays a colour over what is there.
TERRACAST_PACKET_INLINE void lay(Rgb& color, float share, float r, float g, float b) {
  color.r += share * (r - color.r);
  color.g += share * (g - color.g);
  color.b += share * (b - color.b);
}
TERRACAST_PACKET_INLINE void lay(Rgb& color, float share, const Rgb& over) {
  lay(color, share, over.r, over.g, over.b);
}
TERRACAST_PACKET_INLINE void shade(Rgb& color, float factor) {
  color.r *= factor;
  color.g *= factor;
  color.b *= factor;
}

bool any(const Lanes<float>& lanes, float above) {
  return *std::max_element(lanes.values, lanes.values + kLanes) > above;
}

/// Turns the relief's slope into normals: the gradient of the height above the triangle, along it.
TERRACAST_PACKET_CODE void bend_normals(const GroundPacket& g, const NoiseSlope& slope,
                                        const NoisePlane* planes, GroundLook& look) {
  Lanes3f gradient;
  for (Lanes<float>& component : gradient)
    for (int i = 0; i < kLanes; ++i) component[i] = 0.0f;
  for (int plane = 0; plane < kNumNoisePlanes; ++plane) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto along_u = static_cast<float>(planes[plane].u.data()[k]);
      const auto along_v = static_cast<float>(planes[plane].v.data()[k]);
      for (int i = 0; i < kLanes; ++i)
        gradient[k][i] += slope.u[plane][i] * along_u + slope.v[plane][i] * along_v;
    }
  }
  for (int i = 0; i < kLanes; ++i) {
    const float nx = g.normal[0][i];
    const float ny = g.normal[1][i];
    const float nz = g.normal[2][i];
    const float across = gradient[0][i] * nx + gradient[1][i] * ny + gradient[2][i] * nz;
    const float x = nx - (gradient[0][i] - across * nx);
    const float y = ny - (gradient[1][i] - across * ny);
    const float z = nz - (gradient[2][i] - across * nz);
    const float scale = 1.0f / std::sqrt(x * x + y * y + z * z);
    look.normal[0][i] = x * scale;
    look.normal[1][i] = y * scale;
    look.normal[2][i] = z * scale;
  }
}

/// What the covers are painted with.
struct Details {
  const NoiseSum& coarse;
  const NoiseSum& grain;
  const NoiseSum& fine;
  const NoiseSum& stones;
  const NoiseSum& trees;
  const NoiseSum& strata;
  const NoiseSum& cracks;
  Lanes<float> parcel_r;
  Lanes<float> parcel_g;
  Lanes<float> parcel_b;
  Lanes<float> parcel_edge_m;
};

TERRACAST_PACKET_CODE void paint(const GroundPacket& g, const Covers& c, const Details& d,
                                 const Lanes<float>& relief, float tree_line_m, GroundLook& look) {
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
    lay(color, c.grass[i], grass);

    const float furrows = 1.0f + 0.05f * d.coarse.value[i] + 0.06f * patch;
    lay(color, c.field[i], d.parcel_r[i] * furrows, d.parcel_g[i] * furrows,
        d.parcel_b[i] * furrows);
    // Hedges and tracks, 2.5 m to each side of the edge, thinned to their share of the footprint.
    const float reach = larger(2.5f, footprint);
    const float hedge = (2.5f / reach) * step_up(reach - d.parcel_edge_m[i], 0.5f * reach) *
                        ramp(0.8f + 0.5f * clump);
    lay(color, c.field[i] * hedge, 0.040f, 0.055f, 0.022f);

    // Crowns: bright tops, dark gaps.
    const float crown = ramp(0.5f + 0.42f * d.trees.value[i]);
    const float broadleaf = ramp(0.5f + 0.5f * region + 0.5f * patch - 1.2f * high);
    Rgb forest{0.030f, 0.045f, 0.020f};
    lay(forest, broadleaf, 0.058f, 0.078f, 0.026f);
    shade(forest, (0.35f + 1.30f * crown) * (1.0f + 0.18f * d.coarse.value[i] + 0.10f * clump));
    lay(color, c.forest[i], forest);

    lay(color, c.sand[i], 0.40f, 0.335f, 0.235f);

    Rgb scree{0.255f, 0.240f, 0.215f};
    shade(scree, 1.0f + 0.16f * patch + 0.14f * clump);
    lay(color, c.scree[i], scree);

    // Rock: layers of two tints, cracks where the noise passes zero, lichen.
    Rgb rock{0.195f, 0.185f, 0.172f};
    lay(rock, ramp(0.45f + 0.35f * region + 0.45f * d.strata.value[i]), 0.275f, 0.243f, 0.200f);
    shade(rock, 1.0f + 0.16f * d.strata.value[i] + 0.12f * clump + 0.10f * patch);
    const float open = (1.0f - d.cracks.left_out[i]);
    const float nearness = 1.0f - smaller(absolute(d.cracks.value[i]) * 6.0f, 1.0f);
    shade(rock, 1.0f - 0.45f * open * nearness);
    lay(rock, 0.35f * ramp(d.coarse.value[i] - 0.3f), 0.140f, 0.150f, 0.105f);
    lay(color, c.rock[i], rock);

    // Grain of every scale, stones that stand out, less on snow.
    const float bare = larger(larger(c.rock[i], c.scree[i]), 1.0f - c.grass[i]);
    const float grainy = 0.17f + 0.08f * bare;
    const float mottle =
        1.0f + grainy * (d.coarse.value[i] + d.grain.value[i] + d.fine.value[i]) + 0.07f * clump;
    shade(color, clamped(mottle, 0.30f, 1.9f));
    const float stony = bare * (1.0f - c.forest[i]) * (1.0f - d.stones.left_out[i]);
    shade(color, 1.0f + 0.55f * stony * step_up(d.stones.value[i] - 1.15f, 0.30f) -
                     0.35f * stony * step_up(-d.stones.value[i] - 1.25f, 0.30f));

    const float drift = 1.0f + 0.035f * (d.coarse.value[i] + d.grain.value[i] + d.fine.value[i]) +
                        0.03f * clump + 0.02f * patch;
    lay(color, c.snow[i], 0.72f * drift, 0.74f * drift, 0.78f * drift);

    look.albedo[0][i] = clamped(color.r, 0.004f, 0.88f);
    look.albedo[1][i] = clamped(color.g, 0.004f, 0.88f);
    look.albedo[2][i] = clamped(color.b, 0.004f, 0.88f);
    const float hollow = 0.10f * (d.coarse.value[i] + d.grain.value[i]) * relief[i] * 5.0f +
                         0.25f * c.forest[i] * (crown - 0.5f);
    look.openness[i] = clamped(0.90f + hollow, 0.45f, 1.0f);
    look.is_water[i] = 0.0f;
    look.wave_variance[i] = 0.0f;
  }
}

/// The sea: waves from 64 m to 12 cm, whose slopes too small for the footprint become variance;
/// streaks of wind and foam.
void look_at_sea(const GroundPacket& g, std::uint32_t seed, GroundLook& look) {
  Lanes<float> weight;
  Lanes<float> all_scales;
  for (int i = 0; i < kLanes; ++i) {
    weight[i] = 0.035f;
    all_scales[i] = 1e9f;
  }
  NoiseSlope slope{};
  const NoiseSum waves =
      sum_noise_with_slope(g.places, 6, -3, seed + kWaves, weight, all_scales, slope);
  const NoiseSum streaks = sum_noise(g.places, 11, 3, seed + kPatch);
  GroundLook sea;
  bend_normals(g, slope, noise_planes().data(), sea);
  for (int i = 0; i < kLanes; ++i) {
    if (g.cover[i] != static_cast<std::uint8_t>(world::Cover::Sea)) continue;
    for (std::size_t k = 0; k < 3; ++k) look.normal[k][i] = sea.normal[k][i];
    // Light that the water sends back, as an albedo; a little foam where steep waves meet.
    const float tone = 1.0f + 0.30f * streaks.value[i];
    const float foam = 0.10f * step_up(waves.value[i] + 0.8f * streaks.value[i] - 2.4f, 0.5f);
    look.albedo[0][i] = 0.010f * tone + foam;
    look.albedo[1][i] = 0.032f * tone + foam;
    look.albedo[2][i] = 0.040f * tone + foam;
    look.openness[i] = 1.0f;
    look.is_water[i] = 1.0f;
    // Ten octaves of slope 0.035 along each axis, less what is drawn; 0.003 for ripples below them.
    look.wave_variance[i] = 0.003f + 0.0123f * waves.left_out[i] * waves.left_out[i];
  }
}

}  // namespace

double approximate_height_m(const Eigen::Vector3d& p) {
  return height_over_sphere_m(p.x(), p.y(), p.z());
}

Climate climate_of(const world::TileStore& store, std::uint32_t seed) {
  Climate climate;
  climate.seed = seed;
  climate.snow_line_m = world::snow_line_m(store.manifest().origin.lat_deg);
  climate.tree_line_m = world::tree_line_m(store.manifest().origin.lat_deg);

  double sum_m = 0.0;
  std::int64_t num_samples = 0;
  const double half_m = 0.5 * store.manifest().size_m;
  for (const world::TileInfo& info : store.manifest().tiles) {
    if (info.id.level != store.manifest().coarsest_level) continue;
    const geo::Box3d box = info.box_world();
    if (box.min().x() > half_m || box.min().y() > half_m || box.max().x() < -half_m ||
        box.max().y() < -half_m)
      continue;
    const world::Tile tile = store.load(info.id);
    const Eigen::Vector2d corner = info.id.corner_world();
    for (int j = 0; j < world::kTileSamples; ++j) {
      for (int i = 0; i < world::kTileSamples; ++i) {
        if (tile.cover[world::Tile::sample(i, j)] != world::Cover::Sea) continue;
        const Eigen::Vector3d point(corner.x() + i * info.id.spacing_m(),
                                    corner.y() + j * info.id.spacing_m(), tile.z_world(i, j));
        // Far beyond the square approximate_height_m() is metres off.
        if (point.head<2>().cwiseAbs().maxCoeff() > half_m) continue;
        sum_m += approximate_height_m(point);
        ++num_samples;
      }
    }
  }
  climate.has_sea = num_samples > 0;
  if (climate.has_sea) climate.sea_level_m = sum_m / static_cast<double>(num_samples);
  return climate;
}

void Ground::set(const GroundPlaces& places, GroundPacket& packet) const {
  packet.places.set(places.point_world, places.footprint_m);
  set_ground(places, climate_.sea_level_m, packet);
  packet.cover = places.cover;
}

void Ground::classify(const GroundPacket& packet, Lanes<std::uint8_t>& classes) const {
  using capture::SemanticClass;
  Covers c;
  spread_covers(
      packet, climate_,
      [](const auto&... what) {
        return NoiseSum{sum_all_noise(what...), Lanes<float>{}};
      },
      c);
  for (int i = 0; i < kLanes; ++i) {
    SemanticClass found = SemanticClass::Soil;
    if (c.grass[i] > 0.5f || c.field[i] > 0.5f || c.forest[i] > 0.5f) found = SemanticClass::Grass;
    if (c.sand[i] > 0.5f) found = SemanticClass::Sand;
    if (c.scree[i] > 0.5f) found = SemanticClass::Scree;
    if (c.rock[i] > 0.5f) found = SemanticClass::Rock;
    if (c.snow[i] > 0.5f) found = SemanticClass::Snow;
    const auto cover = static_cast<world::Cover>(packet.cover[i]);
    if (cover == world::Cover::Sea) found = SemanticClass::Sea;
    if (cover == world::Cover::Outside) found = SemanticClass::Outside;
    classes[i] = static_cast<std::uint8_t>(found);
  }
}

void Ground::look(const GroundPacket& g, GroundLook& look) const {
  const std::uint32_t seed = climate_.seed;
  Covers c;
  spread_covers(g, climate_, sum_noise, c);

  Lanes<float> relief;        // slope of each octave of small relief
  Lanes<float> relief_below;  // relief coarser than this stands in the terrain
  for (int i = 0; i < kLanes; ++i) {
    const float hard = larger(c.rock[i], 0.8f * c.scree[i]);
    const float soft = larger(c.snow[i], c.sand[i]);
    relief[i] = (0.10f + 0.13f * hard) * (1.0f - 0.55f * soft);
    relief_below[i] = 4.0f * g.spacing_m[i];
  }
  NoiseSlope slope{};
  const NoiseSum coarse =
      sum_noise_with_slope(g.places, 6, 3, seed + kCoarseGrain, relief, relief_below, slope);
  const NoiseSum grain =
      sum_noise_with_slope(g.places, 2, -1, seed + kGrain, relief, relief_below, slope);
  const NoiseSum fine =
      sum_noise_with_slope(g.places, -2, -7, seed + kFineGrain, relief, relief_below, slope);
  const NoiseSum stones = sum_noise(g.places, 0, -3, seed + kStones);

  NoiseSum trees{};
  if (any(c.forest, 0.0f)) {
    Lanes<float> crowns;
    Lanes<float> all_scales;
    for (int i = 0; i < kLanes; ++i) {
      crowns[i] = 0.42f * c.forest[i] * (1.0f - c.rock[i]) * (1.0f - c.scree[i]);
      all_scales[i] = 1e9f;
    }
    trees = sum_noise_with_slope(g.places, 3, 0, seed + kTrees, crowns, all_scales, slope);
  }
  NoiseSum strata{};
  NoiseSum cracks{};
  if (any(c.rock, 0.0f)) {
    Lanes<std::int32_t> u = g.strata_u;
    for (int i = 0; i < kLanes; ++i)
      u[i] += static_cast<std::int32_t>(6.0f * c.patch.value[i] * static_cast<float>(1 << 12));
    strata = sum_noise_at(u, g.strata_v, g.places.footprint_m, 5, 1, seed + kStrata);
    cracks = sum_noise(g.places, 2, 0, seed + kCracks);
  }
  NoiseSum warp{};
  if (any(c.field, 0.0f)) warp = sum_noise(g.places, 8, 5, seed + kFieldWarp);

  // Parcels are picked apart one by one; what follows is the same arithmetic for all lanes.
  Details details{coarse, grain, fine, stones, trees, strata, cracks, {}, {}, {}, {}};
  for (int i = 0; i < kLanes; ++i) {
    Parcel parcel{};
    if (c.field[i] > 0.0f) parcel = parcel_at(g.places, i, 9.0f * warp.value[i], seed);
    details.parcel_r[i] = parcel.color[0];
    details.parcel_g[i] = parcel.color[1];
    details.parcel_b[i] = parcel.color[2];
    details.parcel_edge_m[i] = parcel.edge_m;
  }
  paint(g, c, details, relief, static_cast<float>(climate_.tree_line_m), look);
  bend_normals(g, slope, noise_planes().data(), look);

  bool has_sea = false;
  for (int i = 0; i < kLanes; ++i)
    has_sea = has_sea || g.cover[i] == static_cast<std::uint8_t>(world::Cover::Sea);
  if (has_sea) look_at_sea(g, seed, look);
}

}  // namespace terracast::render
