#include "tests/e2e/hills_job.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/atomic_file.h"
#include "world/tile_file.h"
#include "world/tile_store.h"

namespace terracast::test {

namespace fs = std::filesystem;

std::string hills_job_text() {
  return fmt::format(R"(name = "flights"

[world]
name = "hills"
origin_lat_deg = 46.5
origin_lon_deg = 7.5
size_m = 3072.0
outside = "extend"

[[world.elevation]]
kind = "raster"
files = ["N46E007.hgt"]
vertical_datum = "ellipsoid"
unit = "m"
nodata = "declared"
licence = "CC0-1.0"

[detail]
finest_spacing_m = 1.0

[[rigs]]
name = "one"
mount_pitch_deg = 90.0

[[rigs.cameras]]
name = "left"
width_px = {0}
height_px = {1}
fx_px = {2}
fy_px = {2}

[[rigs.cameras]]
name = "right"
width_px = {0}
height_px = {1}
fx_px = {2}
fy_px = {2}
offset_mm = [0.0, -500.0, 0.0]

[[trajectories]]
name = "P000"
kind = "waypoints"
rate_hz = 1.0
num_frames = {3}
speed_mps = 90.0
waypoints = [
  {{east_m = -900.0, north_m = -300.0, height_m = 900.0, above = "ellipsoid"}},
  {{east_m = 900.0, north_m = -300.0, height_m = 900.0, above = "ellipsoid"}},
]

[conditions]
color_samples = 1
sun_azimuth_deg = 180.0
sun_elevation_deg = 89.0

[tracks]
num_points = 2000

[validate]
oracle_samples = 50

[[exports]]
format = "kitti"
rig = "one"
left = "left"
right = "right"

[[sweep.list]]
keys = ["trajectories.0.waypoints.0.north_m", "trajectories.0.waypoints.1.north_m"]
rows = [[-300.0, -300.0], [300.0, 300.0]]
)",
                     kWidth_px, kHeight_px, kFocal_px, kNumFrames);
}

void write_hills(const fs::path& folder, double raised_m, double lat_deg, double lon_deg) {
  constexpr int kSamples = 1201;
  const int raised_row = static_cast<int>(std::lround((47.0 - lat_deg) * (kSamples - 1)));
  const int raised_column = static_cast<int>(std::lround((lon_deg - 7.0) * (kSamples - 1)));
  std::string bytes;
  for (int row = 0; row < kSamples; ++row) {
    for (int column = 0; column < kSamples; ++column) {
      double height_m = 500.0 + 20.0 * std::sin(0.7 * row) * std::cos(0.9 * column);
      if (row == raised_row && column == raised_column) height_m += raised_m;
      const auto stored = static_cast<std::uint16_t>(std::lround(height_m));
      bytes += static_cast<char>(stored >> 8);
      bytes += static_cast<char>(stored & 0xFF);
    }
  }
  core::write_file(folder / "N46E007.hgt", bytes);
}

ProgramResult plan_hills(const fs::path& config, const fs::path& job, bool is_update) {
  std::vector<std::string> arguments = {"batch", "plan", config.string(), "--out", job.string()};
  if (is_update) arguments.emplace_back("--update");
  return run_program(arguments);
}

fs::path world_of(const fs::path& job, const std::string& run) {
  for (const auto& key : fs::directory_iterator(job / "world"))
    if (fs::exists(key.path() / run / "manifest.json")) return key.path() / run;
  ADD_FAILURE() << "no world";
  return {};
}

void edit_tile(const fs::path& store_folder, const world::TileId& id) {
  const auto store = world::TileStore::open(store_folder);
  world::Tile tile = store.load(id);
  for (int j = 0; j < world::kTileSamples; ++j)
    for (int i = 0; i < world::kTileSamples; ++i) {
      const int from_border = std::min({i, j, world::kTileCells - i, world::kTileCells - j});
      tile.height_steps[world::Tile::sample(i, j)] +=
          static_cast<int>(std::min(from_border, 8) / world::kHeightStep_m);
    }
  const double middle = 0.5 * (tile.lowest_z_world() + tile.highest_z_world());
  const double moved_m = std::round(middle) - tile.center_z_m;
  tile.center_z_m += moved_m;
  for (std::int32_t& steps : tile.height_steps)
    steps -= static_cast<int>(moved_m / world::kHeightStep_m);
  world::write_tile(store_folder, tile);
}

}  // namespace terracast::test
