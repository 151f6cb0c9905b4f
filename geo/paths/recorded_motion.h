#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "geo/paths/attitude.h"
#include "geo/paths/flattened.h"
#include "geo/paths/interpolating_spline.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// Rotations of the body over time: a spline of the four parts of the quaternion, normalised, twice
/// continuously differentiable.
class RotationSpline {
 public:
  /// times_s      increasing, two or more
  /// quaternions  w x y z of world_from_body, neighbours in the same half
  RotationSpline(std::vector<double> times_s, std::vector<Eigen::Vector4d> quaternions,
                 Continuity continuity = Continuity::Second)
      : spline_(std::move(times_s), std::move(quaternions), false, continuity) {}

  struct Value {
    Eigen::Quaterniond world_from_body;
    Eigen::Vector3d angular_velocity_body_radps;
    Eigen::Vector3d angular_acceleration_body_radps2;
  };
  Value at(double time_s) const;
  const std::vector<double>& knots_s() const { return spline_.parameters(); }

 private:
  InterpolatingSplineIn<4> spline_;
};

/// How densely a motion was recorded, rows over the time that they take.
struct RecordedRates {
  double fixes_hz = 0.0;
  std::optional<double> attitudes_hz;  ///< nothing: the attitude follows from the path
};

/// A body that was where a spline over time says: a window of it, from `begin_s` to `end_s` of the
/// spline's time. Its attitude is given, or follows from the motion. Before and after its window the
/// splines go on; beyond their first and last knots by their end pieces.
class RecordedMotion final : public Trajectory {
 public:
  struct Window {
    double begin_s, end_s;
  };
  /// position   flattened coordinates over time
  /// utc_unix_s UTC of the spline's time 0
  RecordedMotion(const WorldFrame& frame, InterpolatingSpline position, Window window,
                 std::optional<double> utc_unix_s, std::variant<Attitude, RotationSpline> attitude);

  double duration_s() const override { return window_.end_s - window_.begin_s; }
  MotionState at(double time_s) const override;
  std::vector<double> knots_s() const override;
  std::optional<double> utc_start_unix_s() const override;
  RecordedRates recorded_rates() const;

 private:
  PointMotion motion_at(double time_s) const;

  Flattened flattened_;
  InterpolatingSpline position_;
  Window window_;
  std::optional<double> utc_unix_s_;
  std::variant<Steering, RotationSpline> attitude_;
};

/// The motion of a spline of flattened coordinates over time.
PointMotion point_motion_at(const InterpolatingSpline& position, const Flattened& flattened,
                            double time_s);

}  // namespace terracast::geo
