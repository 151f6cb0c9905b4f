#include "render/frame_jobs.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "capture/clock.h"
#include "core/parallel.h"
#include "sensors/camera/sight.h"
#include "sensors/moving_record.h"

namespace terracast::render {
namespace {

namespace fs = std::filesystem;

/// Camera images in work at once: enough for every thread to have one while others are encoded, few
/// enough to lose little.
constexpr int kImagesInFlight = 3;
/// Frames whose tiles are loaded before they are needed.
constexpr std::size_t kFramesExpected = 4;

static_assert(world::kCenterReach_m <= 1.0, "as capture::TileScale says");
std::vector<capture::TileScale> scales_of(const world::TileStore& store,
                                          const std::vector<world::CutTile>& cut) {
  std::vector<capture::TileScale> scales;
  scales.reserve(cut.size());
  for (const world::CutTile& tile : cut) {
    const world::TileInfo& info = *store.find(tile.id);
    scales.push_back({.spacing_m = tile.id.spacing_m(),
                      .lowest_z_world = info.lowest_z_world,
                      .highest_z_world = info.highest_z_world});
  }
  return scales;
}

std::vector<geo::Box3d> boxes_of(const world::TileStore& store,
                                 const std::vector<world::CutTile>& cut) {
  std::vector<geo::Box3d> boxes;
  boxes.reserve(cut.size());
  for (const world::CutTile& tile : cut) boxes.push_back(store.find(tile.id)->box_world());
  return boxes;
}

}  // namespace

SequenceWork::SequenceWork(const SequencePlan& plan, const world::TileStore& store,
                           const world::RayQuery& query, const sensors::FrameRenderer& renderer,
                           const std::vector<capture::TrackPoint>& tracks)
    : plan_(plan),
      store_(store),
      query_(query),
      renderer_(renderer),
      tracks_(tracks),
      bodies_(sensors::describe_moving(plan.moving)),
      tiles_(scales_of(store, query.cut())),
      keys_(plan, store, query.cut(), renderer),
      sight_(renderer, boxes_of(store, query.cut())) {
  track_points_world_.reserve(tracks.size());
  for (const capture::TrackPoint& track : tracks) track_points_world_.push_back(track.point_world);
}

capture::CameraRecord SequenceWork::render_camera(int frame, int camera, const capture::Sink& sink,
                                                  world::RayTrail& trail) const {
  return core::with_context(
      [&] {
        core::ScratchPool<sensors::TruthFrame>::Lease lease(truth_frames_);
        sensors::TruthFrame& truth = *lease;
        renderer_.truth(frame, camera, truth, &trail);
        sensors::Photo photo = renderer_.photo(frame, camera, &trail);
        truth.facts.color = std::move(photo.color);
        truth.facts.raw = std::move(photo.raw);
        capture::CameraRecord record = sink.write_camera(frame, camera, truth.facts);
        record.exposure_ev = photo.exposure_ev;
        record.bounds = bounds(frame, camera, truth);
        record.visible_tracks = find_visible_tracks(frame, camera);
        return record;
      },
      fmt::format("rendering frame {}, camera {}/{}", frame,
                  plan_.cameras[static_cast<std::size_t>(camera)].rig,
                  plan_.cameras[static_cast<std::size_t>(camera)].name));
}

std::vector<capture::FrameFile> SequenceWork::measure(
    int frame, const capture::Sink& sink, world::RayTrail& trail,
    std::vector<std::unique_ptr<sensors::ScanMemory>>& memories) const {
  std::vector<capture::FrameFile> files;
  for (const sensors::MountedSensor& sensor : plan_.sensors) {
    const capture::TickRange ticks = capture::ticks_of_frame(
        sensor.info.rate_hz, plan_.rate_hz, frame, static_cast<int>(plan_.states.size()));
    const capture::Samples samples =
        sensor.measure(renderer_.scene(), plan_.motion, static_cast<std::uint64_t>(plan_.seed),
                       ticks, &trail, &memories[files.size()]);
    files.push_back(sink.write_samples(frame, static_cast<int>(files.size()), samples));
  }
  return files;
}

std::vector<std::int64_t> SequenceWork::find_visible_tracks(int frame, int camera) const {
  const world::MovingScene moving =
      renderer_.moving().scene(frame, renderer_.views().longest_reach_s());
  const std::vector<std::uint8_t> is_visible = sensors::visible_in_view(
      {query_, moving}, renderer_.views().open(frame, camera), track_points_world_);
  std::vector<std::int64_t> visible;
  for (std::size_t i = 0; i < is_visible.size(); ++i)
    if (is_visible[i] != 0) visible.push_back(tracks_[i].id);
  return visible;
}

capture::LabelBounds SequenceWork::bounds(int frame, int camera,
                                          const sensors::TruthFrame& truth) const {
  const auto view_at = [&](int at) -> std::optional<capture::CameraView> {
    if (at < 0 || at >= renderer_.views().num_frames()) return std::nullopt;
    return capture::view_of(*renderer_.views().at(at, camera).model,
                            plan_.cameras[static_cast<std::size_t>(camera)],
                            plan_.states[static_cast<std::size_t>(at)]);
  };
  const auto motions_to = [&](int to) {
    if (!view_at(to)) return capture::BodyMotions();
    return capture::BodyMotions(bodies_, renderer_.moving().states(frame),
                                renderer_.moving().states(to));
  };
  return capture::bounds_of_labels(*view_at(frame), view_at(frame + 1), view_at(frame - 1),
                                   truth.facts, truth.crossing_error, tiles_, motions_to(frame + 1),
                                   motions_to(frame - 1));
}

capture::FrameRecord SequenceWork::start_record(int frame) const {
  const geo::BodyState& state = plan_.states[static_cast<std::size_t>(frame)];
  std::vector<double> stamps_s;
  for (std::size_t i = 0; i < plan_.clocks.size(); ++i)
    stamps_s.push_back(capture::stamp_s(plan_.clocks[i], plan_.cameras[i], plan_.seed, plan_.name,
                                        frame, state.time_s));
  return {.index = frame,
          .time_s = state.time_s,
          .stamps_s = std::move(stamps_s),
          .world_from_body = state.world_from_body,
          .velocity_world_mps = state.velocity_world_mps,
          .acceleration_world_mps2 = state.acceleration_world_mps2,
          .angular_velocity_body_radps = state.angular_velocity_body_radps,
          .terms = state.terms,
          .cameras = {},
          .moving = renderer_.moving().states(frame),
          .key = {},
          .touched_tiles = {},
          .passed_tiles = {}};
}

bool SequenceWork::take_over_frame(int frame, const std::vector<EarlierFrames>& all_earlier,
                                   const capture::SequenceWriter& writer) const {
  for (const EarlierFrames& earlier : all_earlier) {
    std::optional<capture::FrameRecord> found = earlier.find(frame);
    if (!found) continue;
    capture::FrameRecord record = start_record(frame);
    record.key = std::move(found->key);
    record.touched_tiles = std::move(found->touched_tiles);
    record.passed_tiles = std::move(found->passed_tiles);
    for (capture::CameraRecord& camera : found->cameras) {
      writer.link_camera(earlier.folder(), camera);
      camera.visible_tracks = find_visible_tracks(frame, static_cast<int>(record.cameras.size()));
      record.cameras.push_back(std::move(camera));
    }
    writer.finish_frame(record);
    return true;
  }
  return false;
}

std::vector<EarlierFrames> SequenceWork::open_earlier(const std::vector<fs::path>& folders,
                                                      const capture::SequenceWriter& writer,
                                                      const core::Log& log) const {
  const RenderInputs inputs{.plan = plan_,
                            .store = store_,
                            .cut = query_.cut(),
                            .tiles = tiles_,
                            .keys = keys_,
                            .sight = sight_};
  std::vector<EarlierFrames> all;
  if (!folders.empty() && renderer_.views().has_open_views()) {
    log.info(
        "sequence {}: with shutters or lenses that are open for a while, or rays from many places, "
        "no earlier frames are taken over",
        plan_.name);
    return all;
  }
  if (!folders.empty() && !plan_.sensors.empty()) {
    log.info("sequence {}: with sensors beside cameras no earlier frames are taken over",
             plan_.name);
    return all;
  }
  if (!folders.empty() && !plan_.moving.empty()) {
    log.info("sequence {}: where things move no earlier frames are taken over", plan_.name);
    return all;
  }
  for (const fs::path& folder : folders) {
    std::error_code not_both_there;
    if (fs::equivalent(folder, writer.folder(), not_both_there)) continue;
    std::optional<EarlierFrames> earlier = EarlierFrames::open(folder, inputs);
    if (earlier)
      all.push_back(std::move(*earlier));
    else
      log.info("{}: nothing there can be taken over", folder.string());
  }
  return all;
}

std::vector<int> SequenceWork::take_over(const std::vector<int>& frames,
                                         const std::vector<fs::path>& earlier_folders,
                                         const capture::SequenceWriter& writer,
                                         const core::Log& log, core::Progress& progress) const {
  const std::vector<EarlierFrames> all_earlier = open_earlier(earlier_folders, writer, log);
  if (all_earlier.empty()) return {};
  std::vector<std::uint8_t> is_taken(frames.size());
  core::parallel_for(static_cast<std::int64_t>(frames.size()), [&](std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    is_taken[at] = take_over_frame(frames[at], all_earlier, writer) ? 1 : 0;
    if (is_taken[at] != 0) progress.advance();
  });
  std::vector<int> taken;
  for (std::size_t at = 0; at < frames.size(); ++at)
    if (is_taken[at] != 0) taken.push_back(frames[at]);
  log.info("sequence {}: {} frames are as they were, {} are not", plan_.name, taken.size(),
           frames.size() - taken.size());
  return taken;
}

void SequenceWork::expect_frames(const std::vector<int>& frames, std::size_t first) const {
  std::vector<std::vector<world::Viewpoint>> turns;
  for (std::size_t i = first; i < std::min(first + kFramesExpected, frames.size()); ++i)
    turns.push_back(sensors::viewpoints_of_frames(renderer_.views(), frames[i], frames[i] + 1));
  query_.expect(turns);
}

void SequenceWork::render(const std::vector<int>& frames, const capture::Sink& sink,
                          core::Progress& progress) const {
  const int num_cameras = renderer_.views().num_cameras();
  struct Image {
    capture::CameraRecord record;
    world::RayTrail trail;
  };
  std::vector<Image> in_flight;
  for (int i = 0; i < kImagesInFlight; ++i)
    in_flight.push_back({.record = {}, .trail = world::RayTrail(query_.cut().size())});
  const auto slot = [&](std::int64_t i) -> Image& {
    return in_flight[static_cast<std::size_t>(i % kImagesInFlight)];
  };
  const auto frame_of = [&](std::int64_t i) {
    return frames[static_cast<std::size_t>(i / num_cameras)];
  };
  capture::FrameRecord record;
  std::vector<std::unique_ptr<sensors::ScanMemory>> memories(plan_.sensors.size());
  world::RayTrail frame_trail(query_.cut().size());
  core::parallel_in_order(
      static_cast<std::int64_t>(frames.size()) * num_cameras, kImagesInFlight,
      [&](std::int64_t i) {
        const int camera = static_cast<int>(i % num_cameras);
        if (camera == 0) expect_frames(frames, static_cast<std::size_t>(i / num_cameras));
        Image& image = slot(i);
        image.trail.clear();
        image.record = render_camera(frame_of(i), camera, sink, image.trail);
      },
      [&](std::int64_t i) {
        if (i % num_cameras == 0) {
          record = start_record(frame_of(i));
          frame_trail.clear();
        }
        record.cameras.push_back(std::move(slot(i).record));
        frame_trail.add(slot(i).trail);
        if (i % num_cameras != num_cameras - 1) return;
        record.streams = measure(record.index, sink, frame_trail, memories);
        set_seen_tiles(frame_trail, tiles_, record);
        record.key = keys_.key(record.index, record.touched_tiles);
        sink.finish_frame(record);
        progress.advance();
      });
}

}  // namespace terracast::render
