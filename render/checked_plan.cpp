#include "render/checked_plan.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "core/error.h"
#include "geo/sun.h"
#include "render/input_hash.h"
#include "scene/moving/moving_bodies.h"
#include "sensors/camera/frame_renderer.h"
#include "sensors/camera/ground_truth.h"
#include "sensors/camera/imaging/exposure_control.h"
#include "sensors/camera/imaging/imager.h"
#include "sensors/motion_check.h"
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

/// throws   Config: more points a frame than fit, or more rays than anybody waits for
void check_scans(const SequencePlan& plan) {
  for (const sensors::MountedSensor& sensor : plan.sensors) {
    const auto* const scanner = dynamic_cast<const sensors::Scanner*>(&*sensor.sensor);
    if (scanner == nullptr) continue;
    const double rows = scanner->rows_per_s(sensor.info.rate_hz) / plan.rate_hz;
    if (!(rows <= sensors::Scanner::kMostRows))
      core::fail(core::ErrorKind::Config,
                 "sequence {}: {}/{} has up to {:.3g} points in the {} s from a frame to the next, "
                 "and {:.3g} fit; take a higher rate_hz of the trajectory",
                 plan.name, sensor.info.rig, sensor.info.name, rows, 1.0 / plan.rate_hz,
                 sensors::Scanner::kMostRows);
    const double rays =
        sensor.least_rays_per_s() * static_cast<double>(plan.states.size()) / plan.rate_hz;
    if (!(rays <= sensors::Scanner::kMostRays))
      core::fail(core::ErrorKind::Config,
                 "sequence {}: {}/{} casts {:.2g} rays at least, and {:.0e} are the most; take "
                 "fewer pixels or samples, a lower rate_hz or fewer frames",
                 plan.name, sensor.info.rig, sensor.info.name, rays, sensors::Scanner::kMostRays);
  }
}

std::vector<capture::StreamInfo> streams_of(const SequencePlan& plan) {
  check_scans(plan);
  std::vector<capture::StreamInfo> streams;
  for (const sensors::MountedSensor& sensor : plan.sensors) streams.push_back(sensor.info);
  return streams;
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

void check_plan(const SequencePlan& plan) {
  if (plan.states.empty()) fail(ErrorKind::Config, "sequence {} has no frames", plan.name);
  if (plan.cameras.empty()) fail(ErrorKind::Config, "sequence {} has no cameras", plan.name);
  plan.conditions.validate();
  check_exposures(plan);
  check_sensors(plan);
  for (const scene::MovingThing& thing : plan.moving)
    TERRACAST_CHECK(
        thing.states.size() == plan.states.size() && thing.gone_m.size() == plan.states.size(),
        "{} moves through {} of {} frames", thing.name, thing.states.size(), plan.states.size());
}

capture::SequenceInfo describe_sequence(const SequencePlan& plan, const world::TileStore& store,
                                        const std::vector<world::CutTile>& cut) {
  const world::WorldManifest& manifest = store.manifest();
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
          .streams = streams_of(plan),
          .config_toml = plan.config_toml,
          .licences = {licences.begin(), licences.end()}};
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

}  // namespace

void check_exposures(const SequencePlan& plan) {
  for (const capture::CameraCalibration& camera : plan.cameras) {
    const double image_s =
        2.0 * camera.shutter.reach_s(camera.intrinsics.width_px, camera.intrinsics.height_px);
    if (image_s * plan.rate_hz > 1.0)
      fail(ErrorKind::Config,
           "sequence {}, camera {}/{}: an image takes {:.4g} ms, its lines' line_time_us together "
           "with "
           "exposure_ms, and the next begins {:.4g} ms later; take less of either, or a lower "
           "rate_hz",
           plan.name, camera.rig, camera.name, 1e3 * image_s, 1e3 / plan.rate_hz);
  }
  for (const sensors::ImagingOptions& imaging : plan.imaging) {
    const double most_s =
        sensors::kMostEarlierFrames / (sensors::kTimeConstantsLookedAt * plan.rate_hz);
    if (imaging.exposure.mode == "automatic" && imaging.exposure.time_constant_s > most_s)
      fail(ErrorKind::Config,
           "sequence {}: imaging.exposure.time_constant_s = {}; at rate_hz = {} it is {:.4g} at "
           "most, as "
           "{} frames are looked at",
           plan.name, imaging.exposure.time_constant_s, plan.rate_hz, most_s,
           sensors::kMostEarlierFrames);
  }
}

void check_sensors(const SequencePlan& plan) {
  if (plan.sensors.empty()) return;
  const double from_unix_s = geo::unix_seconds_from_utc(plan.utc_start);
  const double duration_s = static_cast<double>(plan.states.size()) / plan.rate_hz;
  for (const sensors::MountedSensor& sensor : plan.sensors)
    core::with_context(
        [&] {
          sensor.sensor->check_times(from_unix_s, from_unix_s + duration_s);
          const auto* check = dynamic_cast<const sensors::MotionCheck*>(&*sensor.sensor);
          if (check != nullptr && plan.motion.trajectory)
            check->check_motion(*plan.motion.trajectory);
        },
        fmt::format("checking the sensor {}/{} of sequence {}", sensor.info.rig, sensor.info.name,
                    plan.name));
}

void check_rides(const SequencePlan& plan, const world::TileStore& store,
                 const world::RayQueryOptions& tracing) {
  std::vector<scene::MovingThing> riders;
  std::copy_if(plan.moving.begin(), plan.moving.end(), std::back_inserter(riders),
               [](const scene::MovingThing& thing) { return thing.ride != scene::Ride::Free; });
  if (riders.empty()) return;
  const world::RayQuery query(store, world::choose_cut(store, viewpoints_of(plan), plan.detail),
                              tracing);
  scene::MovingBodies(riders, query, geo::WorldFrame(store.manifest().origin));
}

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

CheckedPlan::CheckedPlan(const SequencePlan& plan, const world::TileStore& store)
    : plan_((check_plan(plan), plan)), store_(store), views_(plan.states, plan.cameras) {
  check_inside(plan, geo::WorldFrame(store.manifest().origin), store.manifest().size_m);
  cut_ = cut_of(store, plan);
  info_ = describe_sequence(plan, store, cut_);
}

void CheckedPlan::check_positions(const scene::Scene& scene) const {
  check_clearance(scene.viewed());
  if (scene.is_in_water()) check_under_surface(scene.whole());
}

/// throws Input: the first camera that is not clearly above the ground
void CheckedPlan::check_clearance(const world::RayQuery& query) const {
  const geo::WorldFrame frame_of_world(store_.manifest().origin);
  const auto check = [&](int frame, int camera, const Eigen::Vector3d& center) {
    const auto where = [&] { return place_of(plan_, frame, camera, center, frame_of_world); };
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
  for (int frame = 0; frame < views_.num_frames(); ++frame)
    for (int camera = 0; camera < views_.num_cameras(); ++camera)
      for (const Eigen::Vector3d& start : starts_of(views_.open(frame, camera)))
        check(frame, camera, start);
}

/// throws Input: a camera that is not clearly under water
void CheckedPlan::check_under_surface(const world::RayQuery& whole) const {
  const geo::WorldFrame frame_of_world(store_.manifest().origin);
  if (plan_.conditions.bottom_range)
    fail(ErrorKind::Config,
         "sequence {}: bottom_range is for cameras above the water, and these are in it",
         plan_.name);
  for (int frame = 0; frame < views_.num_frames(); ++frame)
    for (int camera = 0; camera < views_.num_cameras(); ++camera) {
      const sensors::OpenView view = views_.open(frame, camera);
      if (!view.is_central())
        fail(ErrorKind::Config,
             "{} is under water and of the model {}, whose rays start at many depths; under water "
             "cameras have one centre of projection",
             place_of(plan_, frame, camera, view.middle.center_world, frame_of_world),
             view.middle.model->intrinsics().model);
      for (const Eigen::Vector3d& center : starts_of(view)) {
        const std::optional<double> surface_z = whole.surface_z_world(center.x(), center.y());
        const double depth_m = surface_z.value_or(center.z()) - center.z();
        if (depth_m < kLeastClearance_m)
          fail(ErrorKind::Input,
               "{}: {:.2f} m under the water's surface, where other cameras are under water; a "
               "sequence stays above water or {} m and more below its surface",
               place_of(plan_, frame, camera, center, frame_of_world), depth_m, kLeastClearance_m);
      }
    }
}

}  // namespace terracast::render
