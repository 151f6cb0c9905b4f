// The stage into memory: what a sink is given is what the folder's files hold.

#include <gtest/gtest.h>

#include "capture/frame_reader.h"
#include "core/log.h"
#include "render/frame_jobs.h"
#include "render/render_stage.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

TEST(Sinks, MemoryHoldsWhatTheFolderHolds) {
  const ScratchFolder folder;
  const world::TileStore store = make_hills(folder / "world");
  const render::SequencePlan plan = small_plan(3, 40, 30);
  const core::Log log("test", core::LogLevel::Off);
  const core::Context context{.log = log};
  render::run_render_stage(store, plan, {}, {}, folder / "P000", context);
  const capture::SequenceReader sequence = capture::SequenceReader::open(folder / "P000");

  const TracedPlan traced(store, plan);
  const render::SequenceWork work(traced.plan, traced.store, traced.query, traced.renderer,
                                  sequence.tracks());
  const capture::MemorySink sink;
  core::Progress progress(context, "frames", 2);
  work.render({2, 0}, sink, progress);

  ASSERT_EQ(sink.num_frames(), 2U);
  for (const int frame : {0, 2}) {
    const capture::FrameRecord& written = sequence.frames()[static_cast<std::size_t>(frame)];
    EXPECT_EQ(sink.record(frame).key, written.key);
    EXPECT_EQ(sink.record(frame).touched_tiles, written.touched_tiles);
    for (int camera = 0; camera < static_cast<int>(plan.cameras.size()); ++camera) {
      const capture::CameraFrame read = sequence.read_camera(frame, camera);
      const capture::CameraFrame& kept = sink.images(frame, camera);
      EXPECT_TRUE(kept.color == read.color);
      EXPECT_TRUE(kept.range_m == read.range_m);
      EXPECT_TRUE(kept.flags == read.flags);
      const auto& record = sink.record(frame).cameras[static_cast<std::size_t>(camera)];
      EXPECT_EQ(record.visible_tracks,
                written.cameras[static_cast<std::size_t>(camera)].visible_tracks);
      EXPECT_EQ(record.num_sky, written.cameras[static_cast<std::size_t>(camera)].num_sky);
    }
  }
}

}  // namespace
}  // namespace terracast::test
