#include "tiler/tile_builder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "tiler/layer_stack.h"

namespace terracast::tiler {

using world::kTileSamples;

world::Tile build_tile(const WorldSurface& surface, const world::TileId& id) {
  constexpr std::size_t kCount = static_cast<std::size_t>(kTileSamples) * kTileSamples;
  std::vector<SurfaceSample> samples(kCount);
  surface.sample_tile(id, samples);

  // Rounded in the world, before any centre: neighbours get the same height whatever their centres.
  std::vector<std::int64_t> steps(kCount);
  std::int64_t lowest = std::numeric_limits<std::int64_t>::max();
  std::int64_t highest = std::numeric_limits<std::int64_t>::min();
  for (std::size_t i = 0; i < kCount; ++i) {
    TERRACAST_CHECK(std::isfinite(samples[i].z_world), "tile {}, sample {}", id.name(), i);
    steps[i] = std::llround(samples[i].z_world / world::kHeightStep_m);
    lowest = std::min(lowest, steps[i]);
    highest = std::max(highest, steps[i]);
  }
  const double middle_m = 0.5 * static_cast<double>(lowest + highest) * world::kHeightStep_m;
  const double half_relief_m = 0.5 * static_cast<double>(highest - lowest) * world::kHeightStep_m;
  TERRACAST_CHECK(half_relief_m < 8000.0, "tile {} spans {} m", id.name(), 2.0 * half_relief_m);

  world::Tile tile;
  tile.id = id;
  tile.center_z_m = std::round(middle_m);
  const std::int64_t center_steps = std::llround(tile.center_z_m / world::kHeightStep_m);
  tile.height_steps.resize(kCount);
  tile.cover.resize(kCount);
  tile.moisture.resize(kCount);
  tile.source.resize(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    tile.height_steps[i] = static_cast<std::int32_t>(steps[i] - center_steps);
    tile.cover[i] = samples[i].cover;
    tile.moisture[i] = samples[i].moisture;
    tile.source[i] = samples[i].source;
  }
  surface.layers().add_objects(tile);
  const auto is_water = [](const SurfaceSample& sample) {
    return world::is_water(sample.cover);
  };
  if (std::none_of(samples.begin(), samples.end(), is_water)) return tile;
  tile.water_depth_steps.resize(kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    tile.water_depth_steps[i] = static_cast<std::int32_t>(
        std::llround(std::max(samples[i].water_depth_m, 0.0) / world::kHeightStep_m));
  return tile;
}

}  // namespace terracast::tiler
