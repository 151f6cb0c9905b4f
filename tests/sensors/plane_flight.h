#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <vector>

#include "geo/shutter.h"
#include "tests/support/hills_flight.h"
#include "tests/support/motion_terms.h"
#include "tests/support/test_data.h"

/// A flight over a plane, and what of it is written out once more: where the camera is at a time, and when an image
/// point is exposed.
namespace terracast::test {

inline constexpr double kPlane_z = 40.0;

/// A turn as it is flown by hand: metres a second, and a few degrees of turning in a frame's time, none of which is even.
inline void set_moving(std::vector<geo::BodyState>& states) {
  for (geo::BodyState& state : states) {
    state.velocity_world_mps = {12.0, -3.0, 2.0};
    state.acceleration_world_mps2 = {-4.0, 9.0, 1.5};
    state.angular_velocity_body_radps = {0.4, -0.3, 0.9};
    state.terms = lively_terms();
  }
}

/// A level plane as far as 2048 m to each side, and one camera over it.
struct Flight {
  ScratchFolder folder;
  world::TileStore store =
      make_tiny_world(folder / "world", [](double, double) { return kPlane_z; },
                      {.finest_level = 3, .coarsest_level = 3});
  render::SequencePlan plan = small_plan(2, 40, 32);

  Flight(const geo::CameraIntrinsics& intrinsics, const geo::Shutter& shutter) {
    set_moving(plan.states);
    plan.cameras.resize(1);
    plan.cameras[0].intrinsics = intrinsics;
    plan.cameras[0].shutter = shutter;
  }
};

/// The camera's pose at a time, by the motion's own series.
struct Pose {
  Eigen::Matrix3d world_from_camera;
  Eigen::Vector3d center_world;

  Pose(const render::SequencePlan& plan, int frame, double t)
      : Pose(plan.states[static_cast<std::size_t>(frame)], plan.cameras[0].body_from_camera(), t) {}
  Pose(const geo::BodyState& state, const geo::Rigid3d& mount, double t) {
    const BodyThen body(state, t);
    world_from_camera = body.rotation * mount.rotation.toRotationMatrix();
    center_world = body.place + body.rotation * mount.translation;
  }
  std::optional<Eigen::Vector2d> project(const geo::CameraModel& model,
                                         const Eigen::Vector3d& point) const {
    return model.pixel_from_ray(world_from_camera.transpose() * (point - center_world));
  }
};

/// When an image point's line is exposed: the shutter's definition, written out.
inline double time_of(const geo::Shutter& shutter, const geo::CameraModel& model,
                      const Eigen::Vector2d& pixel) {
  switch (shutter.readout) {
    case geo::Readout::Down:
      return shutter.line_time_s * (pixel.y() - model.height_px() / 2.0);
    case geo::Readout::Up:
      return -shutter.line_time_s * (pixel.y() - model.height_px() / 2.0);
    case geo::Readout::Right:
      return shutter.line_time_s * (pixel.x() - model.width_px() / 2.0);
    case geo::Readout::Left:
      return -shutter.line_time_s * (pixel.x() - model.width_px() / 2.0);
  }
  return 0.0;
}

}  // namespace terracast::test
