#include "scene/ground/ground.h"

#include <algorithm>
#include <cmath>

#include "core/packet_code.h"
#include "scene/ground/natural_cover.h"
#include "scene/ground/pavement.h"
#include "scene/ground/relief.h"
#include "scene/ground/snow.h"
#include "scene/water/water.h"
#include "world/climate.h"

namespace terracast::scene {
namespace {

using core::larger;
using core::smaller;

constexpr double kEarthRadius_m = 6371008.8;

TERRACAST_PACKET_INLINE double height_over_sphere_m(double x, double y, double z) {
  return z + (x * x + y * y) * (0.5 / kEarthRadius_m);
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
  // Beds of rock run on for 8 times their thickness' scale.
  Lanes<double> across_m, along_m;
  for (int i = 0; i < kLanes; ++i) {
    across_m[i] = kAcrossBeds[0] * x[i] + kAcrossBeds[1] * y[i] + kAcrossBeds[2] * z[i];
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
    packet.sea_depth_m[i] = static_cast<float>(places.sea_depth_m[i]);
  }
}

bool any(const Lanes<float>& lanes) {
  return *std::max_element(lanes.values, lanes.values + kLanes) > 0.0f;
}

/// Beds of rock lie in folds of hundreds of metres and bulge by some metres.
/// u       across them, as GroundPacket::strata_u
/// steps   slope of each octave of them
TERRACAST_PACKET_CODE void bend_beds(const GroundPacket& g, const Covers& c, Lanes<std::int32_t>& u,
                                     Lanes<float>& steps) {
  constexpr float kStepsPerMetre = 1.0f / static_cast<float>(kNoiseStep_m);
  for (int i = 0; i < kLanes; ++i) {
    const float bent_m = 40.0f * c.region.value[i] + 6.0f * c.patch.value[i];
    u[i] = g.strata_u[i] + static_cast<std::int32_t>(bent_m * kStepsPerMetre);
    steps[i] = 0.14f * c.rock[i] * (0.25f + 0.75f * bedding_of(c.region.value[i]));
  }
}

/// What is painted is paved: no cover shows.
void clear_painted(const GroundPacket& g, Covers& c) {
  for (int i = 0; i < kLanes; ++i) {
    if (g.is_painted[i] == 0) continue;
    for (Lanes<float>* share : {&c.grass, &c.field, &c.forest, &c.sand, &c.scree, &c.rock, &c.snow,
                                &c.shrubs, &c.floor, &c.meadow, &c.built, &c.wet})
      (*share)[i] = 0.0f;
  }
}

}  // namespace

double approximate_height_m(const Eigen::Vector3d& p) {
  return height_over_sphere_m(p.x(), p.y(), p.z());
}

Climate climate_of(const world::TileStore& store, std::uint32_t seed) {
  Climate climate;
  climate.seed = seed;
  climate.fields =
      world::FieldPattern(static_cast<std::uint64_t>(store.manifest().seed),
                          world::FieldPattern::grows_vines(store.manifest().origin.lat_deg));
  bool has_mapped_cover = false, has_derived_cover = false;
  for (const world::LayerInfo& layer : store.manifest().layers) {
    climate.has_trees = climate.has_trees || layer.kind == "vegetation";
    if (layer.kind != "land_cover") continue;
    (layer.source == "derived" ? has_derived_cover : has_mapped_cover) = true;
  }
  // With both, a place does not say whether its snow was mapped or derived.
  climate.has_mapped_ice = has_mapped_cover && !has_derived_cover;
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
  if (climate.has_sea) climate.exposure = SeaExposure::of(store);
  if (climate.has_sea) climate.sea_level_m = sum_m / static_cast<double>(num_samples);
  return climate;
}

void Ground::set(const GroundPlaces& places, GroundPacket& packet) const {
  packet.places.set(places.point_world, places.footprint_m);
  packet.east_m = places.point_world[0];
  packet.north_m = places.point_world[1];
  set_ground(places, climate_.sea_level_m, packet);
  packet.cover = places.cover;
  packet.has_known_cover = false;
  for (int i = 0; i < kLanes; ++i)
    packet.has_known_cover |= places.cover[i] >= static_cast<std::uint8_t>(world::Cover::Forest);
  packet.is_painted = places.is_painted;
  for (int i = 0; i < kLanes; ++i)
    if (places.is_painted[i] != 0)
      packet.paint[static_cast<std::size_t>(i)] = places.paint[static_cast<std::size_t>(i)];
}

/// guessed   by slope, height, moisture and noise
core::SemanticClass Ground::class_of(world::Cover cover, core::SemanticClass guessed) {
  using core::SemanticClass;
  using world::Cover;
  switch (cover) {
    case Cover::Land:
      return guessed;
    case Cover::Sea:
      return SemanticClass::Sea;
    case Cover::Outside:
      return SemanticClass::Outside;
    case Cover::Forest:
      return SemanticClass::ForestFloor;
    case Cover::Shrubs:
      return SemanticClass::Shrubland;
    case Cover::Grass:
      return guessed == SemanticClass::Snow ? guessed : SemanticClass::Grass;
    case Cover::Crops:
      return SemanticClass::Cropland;
    case Cover::BuiltUp:
      return SemanticClass::BuiltUp;
    case Cover::Bare:  // of what kind, the guess tells
      return guessed == SemanticClass::Rock || guessed == SemanticClass::Scree ||
                     guessed == SemanticClass::Sand || guessed == SemanticClass::Snow
                 ? guessed
                 : SemanticClass::Soil;
    case Cover::Snow:
      return SemanticClass::Snow;
    case Cover::Wetland:
      return SemanticClass::Wetland;
    case Cover::Lake:
      return SemanticClass::Lake;
    case Cover::River:
      return SemanticClass::River;
    case Cover::Seabed:
      return SemanticClass::Seabed;
  }
  return guessed;
}

void Ground::classify(const GroundPacket& packet, Lanes<std::uint8_t>& classes) const {
  using core::SemanticClass;
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
    classes[i] =
        static_cast<std::uint8_t>(class_of(static_cast<world::Cover>(packet.cover[i]), found));
  }
}

void Ground::look(const GroundPacket& g, GroundLook& look) const {
  const std::uint32_t seed = climate_.seed;
  bool is_all_water = true;
  for (int i = 0; i < kLanes; ++i)
    is_all_water =
        is_all_water && g.is_painted[i] == 0 && is_water(static_cast<world::Cover>(g.cover[i]));
  if (is_all_water) {
    look_at_water(g, seed, look);
    return;
  }
  Covers c;
  spread_covers(g, climate_, sum_noise, c);
  if (g.has_known_cover) take_known_covers(g, climate_, c);
  clear_painted(g, c);

  Lanes<float> relief;         // slope of each octave of small relief
  Lanes<float> coarse_relief;  // of those of 8 m and more: rock is shaped by its beds there
  Lanes<float> relief_below;   // relief coarser than this stands in the terrain
  for (int i = 0; i < kLanes; ++i) {
    const float hard = larger(c.rock[i], 0.8f * c.scree[i]);
    const float soft = larger(c.snow[i], c.sand[i]);
    relief[i] = (0.10f + 0.08f * hard) * (1.0f - 0.55f * soft) * (1.0f - 0.75f * c.built[i]) *
                (1.0f - 0.50f * larger(c.meadow[i], c.field[i]));
    if (g.is_painted[i] != 0)
      relief[i] = relief_of(g.paint[static_cast<std::size_t>(i)].coating.paving);
    coarse_relief[i] = relief[i] * (1.0f - 0.6f * c.rock[i]);
    relief_below[i] = 4.0f * g.spacing_m[i];
  }
  NoiseSlope slope{};
  const NoiseSum coarse =
      sum_noise_with_slope(g.places, 6, 3, seed + kCoarseGrain, coarse_relief, relief_below, slope);
  const NoiseSum grain =
      sum_noise_with_slope(g.places, 2, -1, seed + kGrain, relief, relief_below, slope);
  const NoiseSum fine =
      sum_noise_with_slope(g.places, -2, -7, seed + kFineGrain, relief, relief_below, slope);
  const NoiseSum stones = sum_noise(g.places, 0, -3, seed + kStones);

  NoiseSum trees{};
  if (any(c.forest)) {
    Lanes<float> crowns;
    Lanes<float> all_scales;
    for (int i = 0; i < kLanes; ++i) {
      crowns[i] = 0.42f * c.forest[i] * (1.0f - c.rock[i]) * (1.0f - c.scree[i]);
      all_scales[i] = 1e9f;
    }
    trees = sum_noise_with_slope(g.places, 3, 0, seed + kTrees, crowns, all_scales, slope);
  }
  NoiseSum formation{};
  NoiseSum strata{};
  NoiseSum cracks{};
  Lanes<float> bed_slope{};
  if (any(c.rock)) {
    Lanes<std::int32_t> u;
    Lanes<float> steps;
    bend_beds(g, c, u, steps);
    formation = sum_noise_at(u, g.strata_v, g.places.footprint_m, 9, 7, seed + kFormations);
    strata = sum_noise_at_with_slope(u, g.strata_v, g.places.footprint_m, 6, 1, seed + kStrata,
                                     steps, bed_slope);
    cracks = sum_noise(g.places, 2, 0, seed + kCracks);
  }
  NoiseSum bushes{};
  if (any(c.shrubs)) bushes = sum_noise(g.places, 3, 0, seed + kBushes);
  Lanes<float> snow[3]{};
  if (any(c.snow)) paint_snow(g, c, sum_snow_noise(g, c, climate_, slope), climate_, snow);
  paint_land(g, c, {coarse, grain, fine, stones, trees, formation, strata, cracks, bushes, snow},
             relief, climate_, look);
  bend_normals(g, slope, bed_slope, look);

  const auto lanes_with = [&](const auto& has) {
    bool any_lane = false;
    for (int i = 0; i < kLanes; ++i) any_lane = any_lane || has(i);
    return any_lane;
  };
  if (lanes_with([&](int i) { return is_water(static_cast<world::Cover>(g.cover[i])); }))
    look_at_water(g, seed, look);
  if (lanes_with(
          [&](int i) { return static_cast<world::Cover>(g.cover[i]) == world::Cover::Seabed; }))
    look_at_bed(g, seed, look);
  for (int i = 0; i < kLanes; ++i) {
    if (g.is_painted[i] == 0) continue;
    const std::size_t lane = static_cast<std::size_t>(i);
    const PavedLook paved = look_at_paving({.paint = g.paint[lane],
                                            .x_m = g.places.u[0][i] * kNoiseStep_m,
                                            .y_m = g.places.v[0][i] * kNoiseStep_m,
                                            .footprint_m = g.places.footprint_m[i],
                                            .patch = c.patch.value[i],
                                            .clump = c.clump.value[i],
                                            .coarse = coarse.value[i],
                                            .grain = grain.value[i],
                                            .fine = fine.value[i]},
                                           seed);
    look.albedo[0][i] = paved.albedo.r;
    look.albedo[1][i] = paved.albedo.g;
    look.albedo[2][i] = paved.albedo.b;
    look.openness[i] = paved.openness;
    look.is_water[i] = 0.0f;
  }
}

}  // namespace terracast::scene
