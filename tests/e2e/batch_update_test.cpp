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
#include "tests/e2e/hills_job.h"
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

/// A job of two flights, and what is done to it.
class BatchUpdate : public testing::Test {
 protected:
  void SetUp() override {
    write_hills(scratch_.path());
    config_ = write_text(scratch_ / "flights.toml", hills_job_text()).string();
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
  write_hills(scratch_.path(), 4.0, 46.4973, 7.5117);
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
