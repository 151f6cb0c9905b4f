#include "render/plan_check.h"

#include <algorithm>
#include <iterator>

#include "core/error.h"
#include "geo/geodesy.h"
#include "scene/moving/moving_bodies.h"
#include "sensors/camera/imaging/exposure_control.h"
#include "world/lod.h"

namespace terracast::render {

using core::ErrorKind;
using core::fail;

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

}  // namespace terracast::render
