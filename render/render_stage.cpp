#include "render/render_stage.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "capture/begun_sequence.h"
#include "capture/frame_writer.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "render/checked_plan.h"
#include "render/frame_jobs.h"
#include "scene/scene.h"
#include "sensors/camera/frame_renderer.h"
#include "sensors/camera/tracks.h"

namespace terracast::render {
namespace {

void check_selection(const capture::FrameSelection& selection) {
  if (selection.first < 0 || selection.end < selection.first || selection.step < 1) {
    core::fail(
        core::ErrorKind::Usage,
        "frames {} to {} by {}: frames count from 0, a selection ends where it begins or later, "
        "and "
        "its step is 1 or more",
        selection.first, selection.end, selection.step);
  }
}

/// Logs what the tracing read, and how often again where not all of it fits in memory.
void log_tiles(const SequencePlan& plan, const world::RayQueryStats& stats, std::size_t num_frames,
               const core::Log& log) {
  log.info("sequence {}: {} tiles loaded ({} waited for), {:.2f} GB at most, {} re-casts",
           plan.name, stats.num_tiles_loaded, stats.num_tiles_waited,
           static_cast<double>(stats.peak_bytes_resident) * 1e-9, stats.num_recasts);
  if (stats.num_tiles_evicted == 0 || num_frames == 0) return;
  log.info(
      "sequence {}: its tiles do not all fit in tracing.memory_bytes: {:.1f} loads a frame, {:.1f} "
      "of "
      "them from packed tiles",
      plan.name, static_cast<double>(stats.num_tiles_loaded) / static_cast<double>(num_frames),
      static_cast<double>(stats.num_tiles_unpacked) / static_cast<double>(num_frames));
}

/// Logs what scanners cast that cast much.
void log_scans(const SequencePlan& plan, const core::Log& log) {
  constexpr double kMany = 1e9;
  for (const sensors::MountedSensor& sensor : plan.sensors) {
    const double rays =
        sensor.least_rays_per_s() * static_cast<double>(plan.states.size()) / plan.rate_hz;
    if (rays >= kMany)
      log.warn("sequence {}: {}/{} casts {:.2g} rays with light at least, which takes hours",
               plan.name, sensor.info.rig, sensor.info.name, rays);
  }
}

}  // namespace

RenderedFrames run_render_stage(const world::TileStore& store, const SequencePlan& plan,
                                const world::RayQueryOptions& tracing,
                                const capture::FrameSelection& selection,
                                const std::filesystem::path& folder, const core::Context& context,
                                const std::vector<std::filesystem::path>& earlier_folders) {
  check_selection(selection);
  const core::ThreadLimit threads(context.num_threads);
  const CheckedPlan checked(plan, store);
  const capture::SequenceInfo& info = checked.info();
  const std::vector<int> selected = selection.frames_of(info.num_frames);
  const std::optional<std::vector<int>> damaged =
      capture::find_damaged_frames(folder, info, selection);
  if (damaged && damaged->empty()) {
    context.log.info("sequence {}: all {} frames are there", plan.name, selected.size());
    return {};
  }
  if (!damaged && capture::waits_for_others(folder, info, selection)) {
    context.log.info("sequence {}: all {} frames are there; those of other runs are missing yet",
                     plan.name, selected.size());
    return {};
  }
  if (damaged) {
    context.log.warn("sequence {}: {} frames lack files or are damaged, the first is {}", plan.name,
                     damaged->size(), damaged->front());
  }

  const scene::Scene scene(store, checked.cut(), plan.moving, checked.scene_options(tracing));
  const world::RayQuery& query = scene.viewed();
  const sensors::FrameRenderer renderer(plan, checked.views(), scene);
  // Whoever began the sequence has looked under every camera and drawn its points from all frames' images, which
  // loads the tiles of the whole flight.
  std::optional<std::vector<capture::TrackPoint>> begun = capture::tracks_of_begun(folder, info);
  if (!begun) checked.check_positions(scene);
  const std::vector<capture::TrackPoint> tracks =
      begun ? *std::move(begun)
            : sensors::choose_tracks(query, renderer.views(), plan.tracks.num_points,
                                     static_cast<std::uint64_t>(plan.seed), context.log);
  const capture::SequenceWriter writer(folder, info, tracks);

  const auto is_finished = [&](int frame) {
    return damaged ? !std::binary_search(damaged->begin(), damaged->end(), frame)
                   : writer.has_frame(frame);
  };
  std::vector<int> frames;
  std::remove_copy_if(selected.begin(), selected.end(), std::back_inserter(frames), is_finished);
  const std::size_t num_skipped = selected.size() - frames.size();
  context.log.info("sequence {}: {} frames of {} cameras to render, {} are there; {} tiles, {}",
                   plan.name, frames.size(), plan.cameras.size(), num_skipped, query.cut().size(),
                   query.profile());
  if (!frames.empty()) log_scans(plan, context.log);
  const SequenceWork work(plan, store, query, renderer, tracks);
  RenderedFrames done;
  {
    core::Progress progress(context, "frames", static_cast<std::int64_t>(selected.size()));
    progress.skip(static_cast<std::int64_t>(num_skipped));
    done.taken_over = work.take_over(frames, earlier_folders, writer, context.log, progress);
    std::set_difference(frames.begin(), frames.end(), done.taken_over.begin(),
                        done.taken_over.end(), std::back_inserter(done.rendered));
    work.render(done.rendered, writer, progress);
  }
  log_tiles(plan, query.stats(), done.rendered.size(), context.log);
  if (!writer.finish_sequence())
    context.log.info("sequence {}: frames of other runs are missing yet", plan.name);
  return done;
}

}  // namespace terracast::render
