#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/log.h"
#include "render/checked_plan.h"
#include "render/render_stage.h"
#include "rigs/rig.h"
#include "sensors/camera/frame_renderer.h"
#include "tests/support/tiny_world.h"
#include "world/ray_query.h"

/// A small hilly world and flights over it, for tests of the renderer.
namespace terracast::test {

/// Hills of several sizes, some of them steep enough to hide one another.
double hills_m(double x, double y);

/// 4 km of them in tiles of 2 m, 4 m and 8 m.
world::TileStore make_hills(const std::filesystem::path& folder);

rigs::CameraOptions camera_options(const std::string& name, int width_px, int height_px,
                                   double focal_px);

/// A pair with half a metre of baseline, turned down by `pitch_deg`, and a third camera that looks
/// aside.
std::vector<capture::CameraCalibration> small_rig(int width_px, int height_px, double pitch_deg);

/// A gentle climbing turn that starts 90 m above z = 0 over the origin, heading east.
std::vector<geo::BodyState> climbing_turn(int num_frames);

render::SequencePlan small_plan(int num_frames, int width_px, int height_px);

/// A plan with all that traces it.
struct TracedPlan {
  TracedPlan(const world::TileStore& tile_store, render::SequencePlan sequence,
             const world::RayQueryOptions& tracing = {})
      : TracedPlan(tile_store, std::move(sequence), std::nullopt, tracing) {}
  /// Over a cut that the plan did not choose.
  TracedPlan(const world::TileStore& tile_store, render::SequencePlan sequence,
             std::optional<std::vector<world::CutTile>> cut, const world::RayQueryOptions& tracing)
      : store(tile_store),
        plan(std::move(sequence)),
        views(plan.states, plan.cameras),
        scene(store,
              cut ? *std::move(cut)
                  : world::choose_cut(store, render::viewpoints_of(plan.states, plan.cameras),
                                      plan.detail),
              plan.moving, sensors::scene_options(plan, views, tracing)),
        query(scene.whole()),
        renderer(plan, views, scene) {}

  world::TileStore store;
  render::SequencePlan plan;
  sensors::ViewTable views;
  scene::Scene scene;
  const world::RayQuery& query;
  sensors::FrameRenderer renderer;
  core::Log log{"test", core::LogLevel::Off};
};

}  // namespace terracast::test
