#pragma once

#include <filesystem>
#include <string>

#include "tests/support/run_program.h"
#include "world/tile_id.h"

/// A job of two flights over gentle hills, and the edits that a user makes of its world.
namespace terracast::test {

/// Of the cameras, which look straight down, half a metre from each other.
inline constexpr int kWidth_px = 192;
inline constexpr int kHeight_px = 192;
inline constexpr double kFocal_px = 480.0;
inline constexpr int kNumFrames = 16;

/// Two flights to the east, 600 m from each other, over heights from a file; the sun is all but
/// overhead.
std::string hills_job_text();

/// The file of heights, of a degree, 90 m apart, as SRTM has them: gentle hills about 500 m.
/// raised_m   of the sample that is nearest to a place
void write_hills(const std::filesystem::path& folder, double raised_m = 0.0, double lat_deg = 46.5,
                 double lon_deg = 7.5);

/// What `batch plan` says, or with `--update`.
ProgramResult plan_hills(const std::filesystem::path& config, const std::filesystem::path& job,
                         bool is_update = false);

/// The store of a run's world.
std::filesystem::path world_of(const std::filesystem::path& job, const std::string& run);

/// Raises the ground within a tile, as an editor of worlds would.
void edit_tile(const std::filesystem::path& store_folder, const world::TileId& id);

}  // namespace terracast::test
