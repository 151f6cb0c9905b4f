#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "core/atomic_file.h"
#include "core/toml_reader.h"
#include "rigs/rig.h"
#include "tests/support/hills_flight.h"

/// A body that turns briskly over a level plane, for sensors that measure between frames.
namespace terracast::test {

inline constexpr double kPlaneHeight_m = 40.0;
inline constexpr double kDuration_s = 0.3;

/// A body that falls, drifts, and turns about two axes at uneven rates: angles up to 10 rad/s^2.
class BriskMotion : public geo::Trajectory {
 public:
  double duration_s() const override { return kDuration_s; }
  geo::MotionState at(double time_s) const override {
    geo::MotionState state;
    state.time_s = time_s;
    state.world_from_body = {.rotation = rotation(time_s), .translation = position(time_s)};
    return state;
  }
  std::vector<double> knots_s() const override { return {0.0, kDuration_s}; }

  static Eigen::Vector3d position(double t) {
    return {3.0 + 25.0 * t, -4.0 + 6.0 * t * t, 140.0 - 4.9 * t * t + 8.0 * t * t * t};
  }
  static Eigen::Quaterniond rotation(double t) {
    return Eigen::AngleAxisd(0.4 + 5.0 * t * t, Eigen::Vector3d::UnitZ()) *
           Eigen::AngleAxisd(1.1 + 0.3 * std::sin(7.0 * t), Eigen::Vector3d::UnitY());
  }
};

/// Keys of a rig with one camera and sensors.
inline rigs::RigOptions rig_with(const std::filesystem::path& folder, const std::string& sensors) {
  core::write_file(folder / "rig.toml", R"(name = "r"
[[cameras]]
name = "down"
width_px = 24
height_px = 16
fx_px = 20.0
euler_deg = [0.0, 70.0, 0.0]
)" + sensors);
  return core::read_toml<rigs::RigOptions>(folder / "rig.toml");
}

inline render::SequencePlan plan_of(const rigs::RigOptions& rig) {
  render::SequencePlan plan = small_plan(4, 24, 16);
  plan.cameras = rigs::build_cameras({rig});
  plan.sensors = rigs::mount_sensors({rig});
  plan.rate_hz = 10.0;
  plan.motion = {.trajectory = std::make_shared<BriskMotion>(), .start_s = 0.0};
  for (std::size_t i = 0; i < plan.states.size(); ++i)
    plan.states[i] = plan.motion.at(static_cast<double>(i) / plan.rate_hz);
  plan.tracks.num_points = 0;
  return plan;
}

inline world::TileStore make_plane(const std::filesystem::path& folder) {
  return make_tiny_world(folder, [](double, double) { return kPlaneHeight_m; },
                         {.finest_level = 3, .coarsest_level = 3});
}

}  // namespace terracast::test
