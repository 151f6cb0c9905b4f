#include "render/render_stage.h"

#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "capture/frame_reader.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::render {
namespace {

namespace fs = std::filesystem;

std::map<std::string, std::vector<std::byte>> bytes_of(const fs::path& folder) {
  std::map<std::string, std::vector<std::byte>> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = core::read_file(entry.path());
  return files;
}

class RenderStage : public testing::Test {
 protected:
  void render(const SequencePlan& plan, const fs::path& folder,
              const capture::FrameSelection& selection = {}, int num_threads = 2,
              const world::RayQueryOptions& tracing = {}) {
    const core::Log log("test", core::LogLevel::Off);
    const core::Context context{.log = log, .num_threads = num_threads, .events_file = {}};
    run_render_stage(store_, plan, tracing, selection, folder, context);
  }
  core::Error error_of(const SequencePlan& plan, const capture::FrameSelection& selection = {}) {
    try {
      render(plan, scratch_ / "refused", selection);
    } catch (const core::Error& error) {
      return error;
    }
    return {core::ErrorKind::Internal, "no error"};
  }

  test::ScratchFolder scratch_;
  world::TileStore store_ = test::make_hills(scratch_ / "world");
};

TEST_F(RenderStage, BytesDoNotDependOnThreadsShardsOriginOrInterruption) {
  const SequencePlan plan = test::small_plan(4, 40, 30);
  render(plan, scratch_ / "whole");
  const auto whole = bytes_of(scratch_ / "whole");
  EXPECT_EQ(whole.count("manifest.json"), 1u);

  render(plan, scratch_ / "halves", {.first = 1, .step = 2}, 1);
  EXPECT_EQ(bytes_of(scratch_ / "halves").count("manifest.json"), 0u);
  world::RayQueryOptions moved;
  moved.local_origin_world = {512.5, -33.3, 90.0};
  moved.memory_bytes = 64e6;
  render(plan, scratch_ / "halves", {.first = 0, .step = 2}, 2, moved);
  EXPECT_EQ(whole, bytes_of(scratch_ / "halves"));

  // As a kill leaves it: a frame without its record, another with half its images; finished frames
  // stay untouched.
  fs::remove(scratch_ / "halves" / "manifest.json");
  fs::remove(scratch_ / "halves" / "frames" / "000002.json");
  fs::remove(scratch_ / "halves" / "pair" / "left" / "000002.png");
  const auto kept = fs::last_write_time(scratch_ / "halves" / "pair" / "left" / "000001.png");
  render(plan, scratch_ / "halves");
  EXPECT_EQ(whole, bytes_of(scratch_ / "halves"));
  EXPECT_EQ(kept, fs::last_write_time(scratch_ / "halves" / "pair" / "left" / "000001.png"));
}

TEST_F(RenderStage, RangesMakeAWholeSequence) {
  const SequencePlan plan = test::small_plan(3, 24, 16);
  render(plan, scratch_ / "whole");
  render(plan, scratch_ / "ranges", {.first = 1, .end = 3});
  EXPECT_EQ(bytes_of(scratch_ / "ranges").count("frames/000000.json"), 0u);
  EXPECT_EQ(bytes_of(scratch_ / "ranges").count("manifest.json"), 0u);
  render(plan, scratch_ / "ranges", {.first = 0, .end = 0});  // none
  EXPECT_EQ(bytes_of(scratch_ / "ranges").count("frames/000000.json"), 0u);
  render(plan, scratch_ / "ranges", {.first = 0, .end = 1});
  EXPECT_EQ(bytes_of(scratch_ / "whole"), bytes_of(scratch_ / "ranges"));
}

TEST_F(RenderStage, RunsAtTheSameTimeOfTheSameOrOtherFramesEndInAWholeSequence) {
  const SequencePlan plan = test::small_plan(5, 24, 16);
  render(plan, scratch_ / "whole");
  const auto whole = bytes_of(scratch_ / "whole");
  const fs::path folder = scratch_ / "together";
  const std::vector<capture::FrameSelection> selections = {{.first = 0, .end = 3},
                                                           {.first = 0, .end = 3},
                                                           {.first = 2, .end = 5},
                                                           {.first = 1, .step = 2}};
  for (int round = 0; round < 2; ++round) {
    fs::remove_all(folder);
    // At first there is nothing; then the sequence is finished, but has damaged frames.
    for (const bool is_finished : {false, true}) {
      if (is_finished) {
        fs::remove(folder / "frames" / "000001.json");
        core::write_file(folder / "pair" / "left" / "000002.png", std::string_view("damaged"));
        core::write_file(folder / "frames" / "000004.json", std::string_view("damaged"));
      }
      std::vector<std::jthread> runs;
      for (const capture::FrameSelection& selection : selections)
        runs.emplace_back([&, selection] { render(plan, folder, selection); });
      runs.clear();
      EXPECT_EQ(whole, bytes_of(folder)) << "round " << round;
    }
  }
}

TEST_F(RenderStage, FinishedFramesNeedNoTiles) {
  const SequencePlan plan = test::small_plan(4, 24, 16);
  const fs::path folder = scratch_ / "capture";
  const capture::FrameSelection even = {.first = 0, .step = 2};
  const capture::FrameSelection odd = {.first = 1, .step = 2};
  render(plan, folder, even);
  const auto half = bytes_of(folder);
  const fs::path tiles = scratch_ / "world" / "tiles";
  const fs::path away = scratch_ / "tiles";
  fs::rename(tiles, away);
  render(plan, folder, even);
  EXPECT_EQ(half, bytes_of(folder));
  EXPECT_THROW(render(plan, folder, odd), core::Error);  // these do
  fs::rename(away, tiles);
  render(plan, folder, odd);
  const auto whole = bytes_of(folder);
  ASSERT_EQ(whole.count("manifest.json"), 1u);
  fs::rename(tiles, away);
  render(plan, folder);
  EXPECT_EQ(whole, bytes_of(folder));
  fs::rename(away, tiles);
  // Whatever is missing or damaged is noticed.
  fs::remove(folder / "manifest.json");
  for (const char* file : {"sequence.json", "tracks.json", "frames/000002.json"}) {
    fs::remove(folder / "frames" / "000001.json");
    core::write_file(folder / file, std::string_view("damaged"));
    render(plan, folder, even);
    for (const auto& [name, bytes] : half) EXPECT_EQ(bytes, core::read_file(folder / name)) << name;
  }
  render(plan, folder, odd);
  EXPECT_EQ(whole, bytes_of(folder));
}

TEST_F(RenderStage, TheCaptureHoldsWhatThePlanSays) {
  SequencePlan plan = test::small_plan(3, 40, 30);
  render(plan, scratch_ / "capture");
  const auto reader = capture::SequenceReader::open(scratch_ / "capture");
  EXPECT_EQ(reader.info().cameras, plan.cameras);
  EXPECT_EQ(reader.info().num_frames, 3);
  EXPECT_EQ(reader.info().licences, std::vector<std::string>{"CC0"});
  EXPECT_EQ(reader.tracks().size(), 200u);
  std::int64_t num_observations = 0;
  for (int frame = 0; frame < 3; ++frame) {
    const auto& record = reader.frames()[static_cast<std::size_t>(frame)];
    EXPECT_EQ(record.world_from_body, plan.states[static_cast<std::size_t>(frame)].world_from_body);
    for (const auto& camera : record.cameras)
      num_observations += static_cast<std::int64_t>(camera.visible_tracks.size());
  }
  EXPECT_GE(num_observations, 3 * 200);
  const capture::CameraFrame frame = reader.read_camera(1, 2);
  EXPECT_EQ(frame.color.width(), 40);
  EXPECT_EQ(frame.range_m.height(), 30);
}

TEST_F(RenderStage, AnotherPlanInTheSameFolderIsRefused) {
  SequencePlan plan = test::small_plan(1, 24, 16);
  render(plan, scratch_ / "capture");
  plan.seed = 2;
  try {
    render(plan, scratch_ / "capture");
    FAIL() << "not refused";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Config);
    EXPECT_NE(std::string(error.what()).find("--out"), std::string::npos) << error.what();
  }
}

TEST_F(RenderStage, CamerasUnderGroundOrOutsideTheWorldAreNamed) {
  SequencePlan plan = test::small_plan(3, 24, 16);
  plan.states[1].world_from_body.translation.z() = -300.0;
  core::Error error = error_of(plan);
  EXPECT_EQ(error.kind(), core::ErrorKind::Input);
  EXPECT_NE(error.message().find("frame 1, camera pair/left"), std::string::npos) << error.what();
  EXPECT_NE(error.message().find("under the ground"), std::string::npos) << error.what();

  plan = test::small_plan(3, 24, 16);
  plan.states[2].world_from_body.translation.x() = 2100.0;
  error = error_of(plan);
  EXPECT_EQ(error.kind(), core::ErrorKind::Input);
  EXPECT_NE(error.message().find("frame 2"), std::string::npos) << error.what();
  EXPECT_NE(error.message().find("52.0 m outside the world"), std::string::npos) << error.what();
}

TEST_F(RenderStage, PlansThatMakeNoSenseAreRefused) {
  SequencePlan plan = test::small_plan(1, 24, 16);
  EXPECT_EQ(error_of(plan, {.first = -1}).kind(), core::ErrorKind::Usage);
  EXPECT_EQ(error_of(plan, {.first = 3, .end = 2}).kind(), core::ErrorKind::Usage);
  EXPECT_EQ(error_of(plan, {.step = 0}).kind(), core::ErrorKind::Usage);
  plan.states.clear();
  EXPECT_EQ(error_of(plan).kind(), core::ErrorKind::Config);
  plan = test::small_plan(1, 24, 16);
  plan.cameras.clear();
  EXPECT_EQ(error_of(plan).kind(), core::ErrorKind::Config);
  plan = test::small_plan(1, 24, 16);
  plan.utc_start = "yesterday";
  EXPECT_EQ(error_of(plan).kind(), core::ErrorKind::Config);
  plan = test::small_plan(1, 24, 16);
  plan.conditions.sun_azimuth_deg = -0.5;
  EXPECT_EQ(error_of(plan).kind(), core::ErrorKind::Config);
}

}  // namespace
}  // namespace terracast::render
