#include "geo/paths/recorded_motion.h"

#include <algorithm>

#include "core/error.h"

namespace terracast::geo {

// With p the spline and q = p / |p|, the body turns at 2 q* q' (its vector part).
RotationSpline::Value RotationSpline::at(double time_s) const {
  const CubicSplineIn<4>::Value value = spline_.at(time_s);
  const double length = value.value.norm();
  const Eigen::Vector4d unit = value.value / length;
  const Eigen::Vector4d rate = (value.first - unit * unit.dot(value.first)) / length;
  const Eigen::Quaterniond rotation(unit[0], unit[1], unit[2], unit[3]);
  const Eigen::Quaterniond turning(rate[0], rate[1], rate[2], rate[3]);
  return {rotation, 2.0 * (rotation.conjugate() * turning).vec()};
}

PointMotion point_motion_at(const CubicSpline& position, const Flattened& flattened,
                            double time_s) {
  const CubicSpline::Value value = position.at(time_s);
  const PathPoint point = flattened.world_from_flattened({value.value, value.first, value.second});
  return {point.position_world, point.first, point.second};
}

RecordedMotion::RecordedMotion(const WorldFrame& frame, CubicSpline position, Window window,
                               std::optional<double> utc_unix_s,
                               std::variant<Attitude, RotationSpline> attitude)
    : flattened_(frame.origin()),
      position_(std::move(position)),
      window_(window),
      utc_unix_s_(utc_unix_s),
      attitude_([&]() -> std::variant<Steering, RotationSpline> {
        if (auto* given = std::get_if<RotationSpline>(&attitude)) return std::move(*given);
        return Steering(
            frame, std::get<Attitude>(attitude),
            [this](double time_s) { return motion_at(time_s); }, duration_s(), false);
      }()) {}

PointMotion RecordedMotion::motion_at(double time_s) const {
  return point_motion_at(position_, flattened_, window_.begin_s + time_s);
}

std::optional<double> RecordedMotion::utc_start_unix_s() const {
  if (!utc_unix_s_) return std::nullopt;
  return *utc_unix_s_ + window_.begin_s;
}

BodyState RecordedMotion::at(double time_s) const {
  constexpr double kTimeTolerance_s = 1e-9;
  TERRACAST_CHECK(time_s >= -kTimeTolerance_s && time_s <= duration_s() + kTimeTolerance_s,
                  "time {} s of a motion of {} s", time_s, duration_s());
  const double clamped_s = std::clamp(time_s, 0.0, duration_s());
  const PointMotion motion = motion_at(clamped_s);
  BodyState state;
  if (const auto* steering = std::get_if<Steering>(&attitude_)) {
    state = steering->state_at(clamped_s, motion);
  } else {
    const RotationSpline::Value rotation =
        std::get<RotationSpline>(attitude_).at(window_.begin_s + clamped_s);
    state.world_from_body = {rotation.world_from_body, motion.position};
    state.velocity_world_mps = motion.velocity;
    state.acceleration_world_mps2 = motion.acceleration;
    state.angular_velocity_body_radps = rotation.angular_velocity_body_radps;
  }
  state.time_s = time_s;
  return state;
}

}  // namespace terracast::geo
