#include "geo/paths/path_motion.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

struct Moving {
  Eigen::Vector3d value, rate;
};

/// The unit vector along a changing vector.
Moving normalised(const Moving& v) {
  const double length = v.value.norm();
  const Eigen::Vector3d unit = v.value / length;
  return {unit, (v.rate - unit * unit.dot(v.rate)) / length};
}

Moving crossed(const Moving& a, const Moving& b) {
  return {a.value.cross(b.value), a.rate.cross(b.value) + a.value.cross(b.rate)};
}

/// The part of a changing vector at right angles to a changing unit vector.
Moving without(const Moving& v, const Moving& unit) {
  const double along = unit.value.dot(v.value);
  const double along_rate = unit.rate.dot(v.value) + unit.value.dot(v.rate);
  return {v.value - along * unit.value, v.rate - along_rate * unit.value - along * unit.rate};
}

/// The ellipsoid's normal at a moving point. It turns by the ellipsoid's two curvatures: in the
/// meridian by north speed / (M + h), across it by east speed / (N + h).
Moving up_of(const WorldFrame& frame, const Eigen::Vector3d& position,
             const Eigen::Vector3d& velocity) {
  const Geodetic place = frame.geodetic_from_world(position);
  const Eigen::Matrix3d enu = frame.world_from_enu(position);
  const double sin_lat = std::sin(radians_from_degrees(place.lat_deg));
  const double e2 = kWgs84Flattening * (2.0 - kWgs84Flattening);
  const double w2 = 1.0 - e2 * sin_lat * sin_lat;
  const double prime_vertical_m = kWgs84SemiMajorAxis_m / std::sqrt(w2);
  const double meridian_m = prime_vertical_m * (1.0 - e2) / w2;
  return {enu.col(2),
          enu.col(0) * (enu.col(0).dot(velocity) / (prime_vertical_m + place.height_m)) +
              enu.col(1) * (enu.col(1).dot(velocity) / (meridian_m + place.height_m))};
}

}  // namespace

PathMotion::PathMotion(std::shared_ptr<const Path> path, const WorldFrame& frame,
                       const std::vector<SpeedAt>& speeds, const Attitude& attitude, double laps)
    : path_(std::move(path)),
      frame_(frame),
      arc_length_(path_),
      speeds_(speeds),
      attitude_(attitude),
      laps_(laps),
      lap_s_(speeds_.duration_s()) {
  TERRACAST_CHECK(path_->is_closed() || laps_ == 1.0, "{} laps of an open path", laps_);
  if (attitude_.bank) make_roll();
}

// With s the length and c(u) the path, |c'| du/dt = ds/dt; the second line is its derivative.
PathMotion::Motion PathMotion::motion_at(double lap_time_s) const {
  const SpeedProfile::Value travelled = speeds_.at(lap_time_s);
  const PathPoint point = path_->at(arc_length_.parameter_at(travelled.length_m));
  const double metres_per_u = point.first.norm();
  const double u_rate = travelled.speed_mps / metres_per_u;
  const double stretch = point.first.dot(point.second) / metres_per_u;
  const double u_second = (travelled.acceleration_mps2 - u_rate * u_rate * stretch) / metres_per_u;
  return {point.position_world, point.first * u_rate,
          point.second * (u_rate * u_rate) + point.first * u_second};
}

PathMotion::Axes PathMotion::axes_at(const Motion& motion) const {
  const Moving up = up_of(frame_, motion.position, motion.velocity);
  Moving nose{motion.velocity, motion.acceleration};
  if (attitude_.nose == Attitude::Nose::TowardsPoint)
    nose = {attitude_.target_world - motion.position, -motion.velocity};
  if (attitude_.nose != Attitude::Nose::AlongPath) nose = without(nose, up);
  const Moving forward = normalised(nose);
  const Moving left = normalised(crossed(up, forward));
  const Moving body_up = crossed(forward, left);
  Axes axes;
  axes.world_from_axes << forward.value, left.value, body_up.value;
  // Each axis e turns as w x e, and the sum of e x (w x e) over three axes is 2 w.
  axes.angular_velocity = 0.5 * (forward.value.cross(forward.rate) + left.value.cross(left.rate) +
                                 body_up.value.cross(body_up.rate));
  return axes;
}

// Roll follows acceleration, whose own rate jumps where pieces of a path meet. Averaged over a time
// and taken as a spline of the time it is twice continuously differentiable, as a real roll is; a
// steady turn keeps its exact angle.
void PathMotion::make_roll() {
  const bool is_closed = path_->is_closed();
  const double smoothing_s = attitude_.bank->smoothing_s;
  constexpr double kSamplesPerSmoothing = 10.0;
  constexpr double kMostSamples = 2e6;
  const double wanted = std::ceil(lap_s_ * kSamplesPerSmoothing / smoothing_s);
  const auto num_intervals = static_cast<std::size_t>(std::clamp(wanted, 8.0, kMostSamples));
  const double spacing_s = lap_s_ / static_cast<double>(num_intervals);
  std::vector<double> roll_rad(num_intervals + (is_closed ? 0 : 1));
  for (std::size_t i = 0; i < roll_rad.size(); ++i) {
    const double time_s = std::min(static_cast<double>(i) * spacing_s, lap_s_);
    const Motion motion = motion_at(time_s);
    const Moving up = up_of(frame_, motion.position, motion.velocity);
    const Eigen::Vector3d left = up.value.cross(motion.velocity).normalized();
    // A turn to the left lowers the left wing: a negative turn about x forward.
    const double coordinated = -std::atan(motion.acceleration.dot(left) / kGravity_mps2);
    roll_rad[i] = std::clamp(coordinated, -attitude_.bank->limit_rad, attitude_.bank->limit_rad);
  }
  const int reach = static_cast<int>(std::lround(0.5 * smoothing_s / spacing_s));
  roll_rad_.emplace(smoothed(roll_rad, reach, is_closed), lap_s_, is_closed);
}

BodyState PathMotion::at(double time_s) const {
  constexpr double kTimeTolerance_s = 1e-9;
  TERRACAST_CHECK(time_s >= -kTimeTolerance_s && time_s <= duration_s() + kTimeTolerance_s,
                  "time {} s of a motion of {} s", time_s, duration_s());
  double lap_time_s = std::max(time_s, 0.0);
  if (path_->is_closed()) lap_time_s -= lap_s_ * std::floor(lap_time_s / lap_s_);
  lap_time_s = std::clamp(lap_time_s, 0.0, lap_s_);
  const Motion motion = motion_at(lap_time_s);
  const Axes axes = axes_at(motion);
  BodyState state;
  state.time_s = time_s;
  state.velocity_world_mps = motion.velocity;
  state.world_from_body.translation = motion.position;
  Eigen::Quaterniond rotation(axes.world_from_axes);
  state.angular_velocity_body_radps = axes.world_from_axes.transpose() * axes.angular_velocity;
  if (roll_rad_) {
    const UniformSpline::Value roll = roll_rad_->at(lap_time_s);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(roll.value, Eigen::Vector3d::UnitX()));
    rotation = rotation * turn;
    state.angular_velocity_body_radps = turn.conjugate() * state.angular_velocity_body_radps +
                                        roll.first * Eigen::Vector3d::UnitX();
  }
  state.world_from_body.rotation = rotation.normalized();
  return state;
}

}  // namespace terracast::geo
