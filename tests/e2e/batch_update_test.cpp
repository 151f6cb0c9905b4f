#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "world/tile_file.h"
#include "world/tile_store.h"

/// What `batch plan --update` has done again: exactly the frames that saw an edit, by the points that
/// their pixels show; and the dataset is the one that a job of its own makes.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using testing::IsEmpty;

/// Of the cameras, which look straight down, half a metre from each other.
constexpr int kWidth_px = 192;
constexpr int kHeight_px = 192;
constexpr double kFocal_px = 480.0;
constexpr int kNumFrames = 16;

/// Two flights to the east, 600 m from each other, over heights from a file; the sun is all but
/// overhead.
std::string job_text() {
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

/// Heights of a degree, 90 m apart, as SRTM has them: gentle hills about 500 m.
/// raised_m   of the sample that is nearest to a place
void write_heights(const fs::path& folder, double raised_m = 0.0, double lat_deg = 46.5,
                   double lon_deg = 7.5) {
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

void run_well(const std::vector<std::string>& arguments) {
  const auto run = run_program(arguments);
  ASSERT_EQ(run.status, 0) << run.output;
}

/// A job's sequences as they are now, by run.
std::map<std::string, fs::path> sequences_of(const fs::path& job) {
  std::map<std::string, fs::path> newest;
  for (const auto& run : fs::directory_iterator(job / "capture"))
    for (const auto& key : fs::directory_iterator(run)) {
      const fs::path sequence = key.path() / "P000";
      fs::path& last = newest[run.path().filename()];
      if (last.empty() || fs::last_write_time(sequence / "manifest.json") >
                              fs::last_write_time(last / "manifest.json"))
        last = sequence;
    }
  return newest;
}

/// "run0000 7", of all frames whose images stand in other files than in the sequences before. Those
/// that were taken over are the same files under another name.
std::set<std::string> rendered(const std::map<std::string, fs::path>& before, const fs::path& job) {
  std::set<std::string> frames;
  for (const auto& [run, sequence] : sequences_of(job))
    for (int frame = 0; frame < kNumFrames; ++frame) {
      int num_same = 0;
      for (const char* ending : {"png", "exr"}) {
        const auto image = fmt::format("one/left/{:06}.{}", frame, ending);
        num_same += fs::equivalent(sequence / image, before.at(run) / image) ? 1 : 0;
      }
      EXPECT_NE(num_same, 1) << "half a frame is taken over";
      if (num_same == 0) frames.insert(fmt::format("{} {}", run, frame));
    }
  return frames;
}

/// The points that a frame's left image shows, by the range along its pixels' rays.
std::vector<Vector3d> points_of(const capture::SequenceReader& reader, int frame) {
  const auto facts = reader.read_camera(frame, 0, capture::SequenceReader::kFacts);
  const geo::Rigid3d world_from_camera = reader.world_from_camera(frame, 0);
  std::vector<Vector3d> points;
  for (int v = 0; v < kHeight_px; ++v)
    for (int u = 0; u < kWidth_px; ++u) {
      const Vector3d ray((u + 0.5 - 0.5 * kWidth_px) / kFocal_px,
                         (v + 0.5 - 0.5 * kHeight_px) / kFocal_px, 1.0);
      points.push_back(
          world_from_camera *
          (facts.range_m.data()[static_cast<std::size_t>(v * kWidth_px + u)] * ray.normalized()));
    }
  return points;
}

/// Frames that show some of the squares of tiles. Those whose rays come near to a border only, within
/// the right camera's place, the spread of a pixel and a ray to the sun, would be neither here nor
/// there: there must be none.
std::set<std::string> showing(const std::map<std::string, fs::path>& sequences,
                              const std::vector<world::TileId>& tiles) {
  constexpr double kNear_m = 6.0;
  std::set<std::string> frames;
  for (const auto& [run, sequence] : sequences) {
    const auto reader = capture::SequenceReader::open(sequence);
    for (int frame = 0; frame < kNumFrames; ++frame) {
      double deepest_m = -std::numeric_limits<double>::infinity();  // inside a square; outside: < 0
      for (const Vector3d& point : points_of(reader, frame))
        for (const world::TileId& tile : tiles) {
          const Vector3d::Scalar half = 0.5 * tile.side_m();
          const Eigen::Vector2d away = (point.head<2>() - tile.center_world()).cwiseAbs();
          deepest_m = std::max(deepest_m, half - away.maxCoeff());
        }
      EXPECT_GT(std::abs(deepest_m), kNear_m) << run << ", frame " << frame;
      if (deepest_m > 0.0) frames.insert(fmt::format("{} {}", run, frame));
    }
  }
  return frames;
}

/// The store of a run's world.
fs::path world_of(const fs::path& job, const std::string& run) {
  for (const auto& key : fs::directory_iterator(job / "world"))
    if (fs::exists(key.path() / run / "manifest.json")) return key.path() / run;
  ADD_FAILURE() << "no world";
  return {};
}

/// Raises the ground within a tile, as an editor of worlds would.
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

/// A job of two flights, and what is done to it.
class BatchUpdate : public testing::Test {
 protected:
  void SetUp() override {
    write_heights(scratch_.path());
    config_ = write_text(scratch_ / "flights.toml", job_text()).string();
  }

  fs::path planned(const char* name, const std::vector<std::string>& more = {}) {
    const fs::path job = scratch_ / name;
    run_well(joined(
        {"batch", "plan", config_, "--out", job.string(), "--shard-minutes", "0.02", "-q"}, more));
    return job;
  }
  void update(const fs::path& job, const std::vector<std::string>& more = {}) {
    run_well(joined({"batch", "plan", config_, "--out", job.string(), "--update", "-q"}, more));
  }
  static void run(const fs::path& job, const std::vector<std::string>& more = {}) {
    run_well(joined({"batch", "run", job.string(), "-q"}, more));
  }
  static std::vector<std::string> joined(std::vector<std::string> arguments,
                                         const std::vector<std::string>& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  static std::string checksums_of(const fs::path& job) {
    return core::read_text_file(job / "dataset/SHA256SUMS");
  }
  /// A tile that the first flight shows in its middle.
  static world::TileId shown_tile(const fs::path& job) {
    const auto reader = capture::SequenceReader::open(sequences_of(job).at("run0000"));
    const Vector3d point = points_of(reader, kNumFrames / 2).at(0);
    for (const capture::ShownTile& shown : reader.info().geometry.tiles) {
      const world::TileId id{shown.level, shown.x, shown.y};
      if (id == world::tile_at(id.level, point.x(), point.y())) return id;
    }
    ADD_FAILURE() << "no tile is shown there";
    return {};
  }

  ScratchFolder scratch_;
  std::string config_;
};

TEST_F(BatchUpdate, OfAKeyThatNoImageShowsNothingIsRenderedAndOfATileExactlyTheFramesThatSawIt) {
  const fs::path job = planned("job");
  run(job);
  auto before = sequences_of(job);
  const std::vector<std::string> fewer_tracks = {"--set", "tracks.num_points=1500"};
  update(job, fewer_tracks);
  run(job);
  EXPECT_THAT(rendered(before, job), IsEmpty());

  before = sequences_of(job);
  const world::TileId tile = shown_tile(job);
  edit_tile(world_of(job, "run0000"), tile);
  update(job, fewer_tracks);
  run(job);
  const auto seen = showing(before, {tile});
  EXPECT_GE(seen.size(), 1U);
  EXPECT_LE(seen.size(), static_cast<std::size_t>(kNumFrames));  // half of them all
  EXPECT_EQ(rendered(before, job), seen);

  const fs::path fresh = planned("fresh", fewer_tracks);
  run(fresh, {"--stage", "tile"});
  edit_tile(world_of(fresh, "run0000"), tile);
  update(fresh, fewer_tracks);
  run(fresh);
  EXPECT_EQ(checksums_of(job), checksums_of(fresh));
}

TEST_F(BatchUpdate, AfterAnEditOfALayerExactlyTheFramesThatSawOtherTilesAreRenderedAgain) {
  const fs::path job = planned("job");
  run(job);
  const auto before = sequences_of(job);
  const fs::path world_before = world_of(job, "run0000");
  write_heights(scratch_.path(), 4.0, 46.4973, 7.5117);
  update(job);
  run(job);
  fs::path world_now;
  for (const auto& key : fs::directory_iterator(job / "world"))
    if (key.path() != world_before.parent_path()) world_now = key.path() / "run0000";
  ASSERT_FALSE(world_now.empty());

  const auto reader = capture::SequenceReader::open(before.at("run0000"));
  std::vector<world::TileId> changed;
  for (const capture::ShownTile& shown : reader.info().geometry.tiles) {
    const world::TileId id{shown.level, shown.x, shown.y};
    if (core::read_file(world::tile_path(world_before, id)) !=
        core::read_file(world::tile_path(world_now, id)))
      changed.push_back(id);
  }
  const auto seen = showing(before, changed);
  EXPECT_GE(seen.size(), 1U);
  EXPECT_LE(seen.size(), static_cast<std::size_t>(kNumFrames));  // half of them all
  EXPECT_EQ(rendered(before, job), seen);

  const fs::path fresh = planned("fresh");
  run(fresh);
  EXPECT_EQ(checksums_of(job), checksums_of(fresh));
}

}  // namespace
}  // namespace terracast::test
