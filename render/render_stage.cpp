#include "render/render_stage.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "capture/frame_writer.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "geo/geodesy.h"
#include "render/frame_jobs.h"
#include "render/input_hash.h"
#include "render/plan_check.h"
#include "sensors/camera/frame_renderer.h"
#include "sensors/camera/imaging/imager.h"
#include "sensors/camera/tracks.h"
#include "sensors/moving_record.h"

namespace terracast::render {
namespace {

using core::ErrorKind;
using core::fail;

/// Cameras nearer to the ground than this stand in it for all that images can show.
constexpr double kLeastClearance_m = 0.25;

std::vector<world::CutTile> cut_of(const world::TileStore& store, const SequencePlan& plan) {
  std::vector<world::CutTile> cut = world::choose_cut(store, viewpoints_of(plan), plan.detail);
  if (cut.size() > sensors::kMaxCutTiles) {
    fail(ErrorKind::Input,
         "sequence {} needs {} tiles at once; up to {} can be told apart: raise detail.cell_px or "
         "detail.finest_spacing_m, or cut the trajectory in two",
         plan.name, cut.size(), sensors::kMaxCutTiles);
  }
  return cut;
}

capture::ShownGeometry geometry_of(const SequencePlan& plan, const world::TileStore& store,
                                   const std::vector<world::CutTile>& cut) {
  capture::ShownGeometry geometry{.cell_px = plan.detail.cell_px,
                                  .finest_spacing_m = plan.detail.finest_spacing_m,
                                  .tiles = {}};
  for (const world::CutTile& tile : cut) {
    const world::TileInfo& info = *store.find(tile.id);
    geometry.tiles.push_back({.level = tile.id.level,
                              .x = tile.id.x,
                              .y = tile.id.y,
                              .content_hash = info.content_hash,
                              .highest_z_world_m = info.highest_z_world});
  }
  return geometry;
}

/// What the capture says of the cameras' imaging.
std::vector<capture::CameraImaging> describe_imaging(const SequencePlan& plan) {
  std::vector<capture::CameraImaging> imaging(plan.imaging.size());
  for (std::size_t i = 0; i < imaging.size(); ++i)
    if (plan.imaging[i].is_on())
      imaging[i] =
          sensors::describe_imaging(plan.imaging[i], plan.cameras[i], plan.seed, plan.name);
  return imaging;
}

void check_plan(const SequencePlan& plan, const capture::FrameSelection& selection) {
  if (plan.states.empty()) fail(ErrorKind::Config, "sequence {} has no frames", plan.name);
  if (plan.cameras.empty()) fail(ErrorKind::Config, "sequence {} has no cameras", plan.name);
  if (selection.first < 0 || selection.end < selection.first || selection.step < 1) {
    fail(ErrorKind::Usage,
         "frames {} to {} by {}: frames count from 0, a selection ends where it begins or later, "
         "and "
         "its step is 1 or more",
         selection.first, selection.end, selection.step);
  }
  plan.conditions.validate();
  check_exposures(plan);
  for (const scene::MovingThing& thing : plan.moving)
    TERRACAST_CHECK(
        thing.states.size() == plan.states.size() && thing.gone_m.size() == plan.states.size(),
        "{} moves through {} of {} frames", thing.name, thing.states.size(), plan.states.size());
}

std::string place_of(const SequencePlan& plan, int frame, int camera,
                     const Eigen::Vector3d& center_world, const geo::WorldFrame& frame_of_world) {
  const geo::Geodetic place = frame_of_world.geodetic_from_world(center_world);
  const capture::CameraCalibration& calibration = plan.cameras[static_cast<std::size_t>(camera)];
  return fmt::format("sequence {}, frame {}, camera {}/{} at {:.6f} N {:.6f} E {:.1f} m", plan.name,
                     frame, calibration.rig, calibration.name, place.lat_deg, place.lon_deg,
                     place.height_m);
}

// Where rays start at many places, so many a side are looked at.
constexpr int kStartsLookedAt = 16;

/// Where a camera's rays start at a frame's time, and when its image begins and ends.
std::vector<Eigen::Vector3d> starts_of(const sensors::OpenView& view) {
  const geo::CameraModel& model = *view.middle.model;
  const double reach_s = view.motion.shutter.reach_s(model.width_px(), model.height_px());
  std::vector<Eigen::Vector3d> starts = view.middle.starts_world(kStartsLookedAt);
  if (reach_s == 0.0) return starts;
  for (const double offset_s : {-reach_s, reach_s})
    for (const Eigen::Vector3d& start : view.at(offset_s).starts_world(kStartsLookedAt))
      starts.push_back(start);
  return starts;
}

/// throws Input: the first camera that stands not clearly above the ground
void check_clearance(const SequencePlan& plan, const world::TileStore& store,
                     const world::RayQuery& query, const sensors::ViewTable& views) {
  const geo::WorldFrame frame_of_world(store.manifest().origin);
  const auto check = [&](int frame, int camera, const Eigen::Vector3d& center) {
    const auto where = [&] { return place_of(plan, frame, camera, center, frame_of_world); };
    const std::optional<double> ground_z = query.surface_z_world(center.x(), center.y());
    if (!ground_z) fail(ErrorKind::Input, "{}: the world has no ground there", where());
    const double clearance_m = center.z() - *ground_z;
    if (clearance_m < 0.0) {
      fail(ErrorKind::Input, "{}: {:.2f} m under the ground{}; raise the trajectory there", where(),
           -clearance_m,
           query.is_without_water() ? ", which is the bed of water or land there" : "");
    }
    if (clearance_m < kLeastClearance_m) {
      fail(ErrorKind::Input, "{}: {:.2f} m above the ground; a camera needs {} m", where(),
           clearance_m, kLeastClearance_m);
    }
  };
  for (int frame = 0; frame < views.num_frames(); ++frame)
    for (int camera = 0; camera < views.num_cameras(); ++camera)
      for (const Eigen::Vector3d& start : starts_of(views.open(frame, camera)))
        check(frame, camera, start);
}

/// Whether any tile may hold water.
bool may_have_water(const world::WorldManifest& manifest) {
  const auto is_sea = [](const world::SourceInfo& source) { return source.kind == "sea"; };
  const auto brings_water = [](const world::LayerInfo& layer) {
    return layer.kind == "water" || layer.kind == "land_cover";
  };
  return std::any_of(manifest.sources.begin(), manifest.sources.end(), is_sea) ||
         std::any_of(manifest.layers.begin(), manifest.layers.end(), brings_water);
}

/// Whether the first camera stands under the surface; then all must.
bool starts_under_surface(const world::RayQuery& whole, const sensors::ViewTable& views) {
  const Eigen::Vector3d& center = views.at(0, 0).center_world;
  const std::optional<double> surface_z = whole.surface_z_world(center.x(), center.y());
  return surface_z && center.z() < *surface_z;
}

/// throws Input: a camera that does not stand clearly under water
void check_under_surface(const SequencePlan& plan, const world::TileStore& store,
                         const world::RayQuery& whole, const sensors::ViewTable& views) {
  const geo::WorldFrame frame_of_world(store.manifest().origin);
  if (plan.conditions.bottom_range)
    fail(ErrorKind::Config,
         "sequence {}: bottom_range is for cameras above the water, and these are in it",
         plan.name);
  for (int frame = 0; frame < views.num_frames(); ++frame)
    for (int camera = 0; camera < views.num_cameras(); ++camera) {
      const sensors::OpenView view = views.open(frame, camera);
      if (!view.is_central())
        fail(ErrorKind::Config,
             "{} is under water and of the model {}, whose rays start at many depths; under water "
             "cameras have one centre of projection",
             place_of(plan, frame, camera, view.middle.center_world, frame_of_world),
             view.middle.model->intrinsics().model);
      for (const Eigen::Vector3d& center : starts_of(view)) {
        const std::optional<double> surface_z = whole.surface_z_world(center.x(), center.y());
        const double depth_m = surface_z.value_or(center.z()) - center.z();
        if (depth_m < kLeastClearance_m)
          fail(ErrorKind::Input,
               "{}: {:.2f} m under the water's surface, where other cameras are under water; a "
               "sequence stays above water or {} m and more below its surface",
               place_of(plan, frame, camera, center, frame_of_world), depth_m, kLeastClearance_m);
      }
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

}  // namespace

void check_inside(const SequencePlan& plan, const geo::WorldFrame& frame_of_world, double size_m) {
  const sensors::ViewTable views(plan.states, plan.cameras);
  for (int frame = 0; frame < views.num_frames(); ++frame)
    for (int camera = 0; camera < views.num_cameras(); ++camera)
      for (const Eigen::Vector3d& start : views.at(frame, camera).starts_world(1)) {
        if (!start.allFinite())
          fail(ErrorKind::Input, "sequence {}, frame {}: the pose is not finite", plan.name, frame);
        const double outside_m = std::max(std::abs(start.x()), std::abs(start.y())) - 0.5 * size_m;
        if (outside_m > 0.0)
          fail(
              ErrorKind::Input,
              "{}: {:.1f} m outside the world, which reaches {:.1f} m from its origin to each side",
              place_of(plan, frame, camera, start, frame_of_world), outside_m, 0.5 * size_m);
      }
}

std::vector<world::Viewpoint> viewpoints_of(
    const std::vector<geo::BodyState>& states,
    const std::vector<capture::CameraCalibration>& cameras) {
  const sensors::ViewTable views(states, cameras);
  return sensors::viewpoints_of_frames(views, 0, views.num_frames() - 1);
}

std::vector<world::Viewpoint> viewpoints_of(const SequencePlan& plan) {
  return plan.shared_viewpoints ? *plan.shared_viewpoints
                                : viewpoints_of(plan.states, plan.cameras);
}

capture::SequenceInfo describe_sequence(const SequencePlan& plan, const world::TileStore& store) {
  const world::WorldManifest& manifest = store.manifest();
  const std::vector<world::CutTile> cut = cut_of(store, plan);
  std::set<std::string> licences;
  for (const world::SourceInfo& source : manifest.sources)
    if (!source.licence.empty()) licences.insert(source.licence);
  return {.name = plan.name,
          .input_hash = input_hash_of(plan, store, cut),
          .world_name = manifest.name,
          .world_input_hash = manifest.input_hash,
          .origin = manifest.origin,
          .utc_start = plan.utc_start,
          .rate_hz = plan.rate_hz,
          .num_frames = static_cast<int>(plan.states.size()),
          .geometry = geometry_of(plan, store, cut),
          .cameras = plan.cameras,
          .believed_cameras = plan.believed_cameras,
          .clocks = plan.clocks,
          .imaging = describe_imaging(plan),
          .moving = sensors::describe_moving(plan.moving),
          .config_toml = plan.config_toml,
          .licences = {licences.begin(), licences.end()}};
}

RenderedFrames run_render_stage(const world::TileStore& store, const SequencePlan& plan,
                                const world::RayQueryOptions& tracing,
                                const capture::FrameSelection& selection,
                                const std::filesystem::path& folder, const core::Context& context,
                                const std::vector<std::filesystem::path>& earlier_folders) {
  check_plan(plan, selection);
  check_inside(plan, geo::WorldFrame(store.manifest().origin), store.manifest().size_m);
  const core::ThreadLimit threads(context.num_threads);
  const capture::SequenceInfo info = describe_sequence(plan, store);
  const std::vector<int> selected = selection.frames_of(info.num_frames);
  const std::optional<std::vector<int>> damaged =
      capture::find_damaged_frames(folder, info, selection);
  if (damaged && damaged->empty()) {
    context.log.info("sequence {}: all {} frames are there", plan.name, selected.size());
    return {};
  }
  if (damaged) {
    context.log.warn("sequence {}: {} frames lack files or are damaged, the first is {}", plan.name,
                     damaged->size(), damaged->front());
  }

  const bool is_wet = plan.conditions.bottom_range || may_have_water(store.manifest());
  const world::RayQuery whole(store, cut_of(store, plan), tracing);
  std::optional<world::RayQuery> bed;
  const bool is_in_water =
      is_wet && starts_under_surface(whole, sensors::ViewTable(plan.states, plan.cameras));
  if (is_wet) bed.emplace(whole, world::RayQuery::WithoutWater{.viewers_in_water = is_in_water});
  const world::RayQuery& query = is_in_water ? *bed : whole;
  const sensors::FrameRenderer renderer(plan, store, whole, bed ? &*bed : nullptr, is_in_water);
  check_clearance(plan, store, query, renderer.views());
  if (is_in_water) check_under_surface(plan, store, whole, renderer.views());
  const std::vector<capture::TrackPoint> tracks =
      sensors::choose_tracks(query, renderer.views(), plan.tracks.num_points,
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
  const SequenceWork work(plan, store, query, renderer, writer, tracks);
  RenderedFrames done;
  {
    core::Progress progress(context, "frames", static_cast<std::int64_t>(selected.size()));
    progress.skip(static_cast<std::int64_t>(num_skipped));
    done.taken_over = work.take_over(frames, earlier_folders, context.log, progress);
    std::set_difference(frames.begin(), frames.end(), done.taken_over.begin(),
                        done.taken_over.end(), std::back_inserter(done.rendered));
    work.render(done.rendered, progress);
  }
  log_tiles(plan, query.stats(), done.rendered.size(), context.log);
  if (!writer.finish_sequence())
    context.log.info("sequence {}: frames of other runs are missing yet", plan.name);
  return done;
}

}  // namespace terracast::render
