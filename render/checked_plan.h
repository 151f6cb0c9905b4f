#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "geo/geodesy.h"
#include "render/sequence_plan.h"
#include "scene/scene.h"
#include "sensors/camera/frame_renderer.h"
#include "sensors/camera/views.h"
#include "world/lod.h"
#include "world/ray_query.h"
#include "world/tile_store.h"

namespace terracast::render {

/// Every camera at every frame is inside the square of `size_m` about the world's origin.
/// throws   Input: one is not, named with its position
void check_inside(const SequencePlan& plan, const geo::WorldFrame& frame_of_world, double size_m);

/// A sequence's frame rate leaves its cameras the time that their images take.
/// throws   Config: an image that takes longer than the time to the next, or an exposure control that looks back over
///          more frames than it may
void check_exposures(const SequencePlan& plan);

/// throws   Config: a sensor beside the cameras that cannot measure at the sequence's date
void check_sensors(const SequencePlan& plan);

/// Whatever rides ground or water finds it, at every frame.
/// cost     some rays for each such body and frame
/// throws   as MovingBodies
void check_rides(const SequencePlan& plan, const world::TileStore& store,
                 const world::RayQueryOptions& tracing);

/// The positions from which cameras see the world: the tiler and the frozen cut are given these.
std::vector<world::Viewpoint> viewpoints_of(const std::vector<geo::BodyState>& states,
                                            const std::vector<capture::CameraCalibration>& cameras);

/// Those for which the geometry that a sequence shows is chosen.
std::vector<world::Viewpoint> viewpoints_of(const SequencePlan& plan);

/// A plan that can be rendered in a world, with all that follows from both. Threads: safe.
class CheckedPlan {
 public:
  /// Both must outlive it.
  /// throws   Config: a plan without frames or cameras, conditions or exposures that make no sense; Input: a camera
  ///          outside the world, or more tiles at once than can be told apart
  CheckedPlan(const SequencePlan& plan, const world::TileStore& store);

  const SequencePlan& plan() const { return plan_; }
  const world::TileStore& store() const { return store_; }
  const sensors::ViewTable& views() const { return views_; }
  /// The tiles that stand in all frames.
  const std::vector<world::CutTile>& cut() const { return cut_; }
  /// The capture's record of the sequence; its input_hash is of everything that determines the capture.
  const capture::SequenceInfo& info() const { return info_; }

  scene::SceneOptions scene_options(const world::RayQueryOptions& tracing) const {
    return sensors::scene_options(plan_, views_, tracing);
  }

  /// Every camera is clearly above the ground, or all are clearly under water.
  /// throws   Input: the first that is not (frame, position, by how much); Config: cameras that cannot be under water
  void check_positions(const scene::Scene& scene) const;

 private:
  void check_clearance(const world::RayQuery& query) const;
  void check_under_surface(const world::RayQuery& whole) const;

  const SequencePlan& plan_;
  const world::TileStore& store_;
  sensors::ViewTable views_;
  std::vector<world::CutTile> cut_;
  capture::SequenceInfo info_;
};

}  // namespace terracast::render
