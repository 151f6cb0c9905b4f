#include "geo/paths/attitude.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace terracast::geo {
namespace {

struct Sampling {
  std::size_t num_intervals;
  double spacing_s;
};

/// Ten samples in each `smoothing_s`.
Sampling sampling_of(double duration_s, double smoothing_s) {
  constexpr double kSamplesPerSmoothing = 10.0;
  constexpr double kMostSamples = 2e6;
  const double wanted = std::ceil(duration_s * kSamplesPerSmoothing / smoothing_s);
  const auto num_intervals = static_cast<std::size_t>(std::clamp(wanted, 8.0, kMostSamples));
  return {num_intervals, duration_s / static_cast<double>(num_intervals)};
}

void append_knots(const std::optional<UniformSpline>& spline, std::vector<double>& knots_s) {
  if (!spline) return;
  for (std::size_t i = 0; i <= spline->num_intervals(); ++i)
    knots_s.push_back(static_cast<double>(i) * spline->spacing());
}

}  // namespace

PointMotion PointMotion::extended(double later_s) const {
  return {position + later_s * (velocity + 0.5 * later_s * acceleration),
          velocity + later_s * acceleration, acceleration, Eigen::Vector3d::Zero()};
}

Steering::Steering(const WorldFrame& frame, const Attitude& attitude,
                   const std::function<PointMotion(double)>& motion, double duration_s,
                   bool is_closed)
    : frame_(frame), attitude_(attitude) {
  if (attitude_.slow_mps > 0.0) hold_heading(motion, duration_s);
  if (attitude_.bank) make_roll(motion, duration_s, is_closed);
}

// Between the times that are faster than half of slow_mps the heading turns evenly from one to the
// other, the short way; before the first and after the last it stays.
void Steering::hold_heading(const std::function<PointMotion(double)>& motion, double duration_s) {
  constexpr double kSmoothing_s = 0.5;
  const Sampling sampling = sampling_of(duration_s, kSmoothing_s);
  std::vector<double> heading_rad(sampling.num_intervals + 1, 0.0);
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < heading_rad.size(); ++i) {
    const PointMotion now =
        motion(std::min(static_cast<double>(i) * sampling.spacing_s, duration_s));
    const Eigen::Vector3d velocity_enu =
        frame_.world_from_enu(now.position).transpose() * now.velocity;
    if (velocity_enu.head<2>().norm() < 0.5 * attitude_.slow_mps) continue;
    double heading = std::atan2(velocity_enu.x(), velocity_enu.y());
    if (!last) {
      std::fill_n(heading_rad.begin(), i, heading);
    } else {
      const double before = heading_rad[*last];
      heading = before + std::remainder(heading - before, 2.0 * std::numbers::pi);
      for (std::size_t k = *last + 1; k < i; ++k) {
        heading_rad[k] = before + (heading - before) * static_cast<double>(k - *last) /
                                      static_cast<double>(i - *last);
      }
    }
    heading_rad[i] = heading;
    last = i;
  }
  if (last)
    std::fill(heading_rad.begin() + static_cast<long>(*last), heading_rad.end(),
              heading_rad[*last]);
  held_heading_rad_.emplace(std::move(heading_rad), duration_s, false, attitude_.continuity);
}

// A smooth step over the horizontal speed s leads from the held heading (s < slow / 2) to the
// velocity (s > slow). Where both count the held heading is the velocity's own, so their sum is
// never nought.
Changing Steering::direction_of_travel(double time_s, const PointMotion& motion,
                                       const Changing& up) const {
  const Changing velocity{motion.velocity, motion.acceleration, motion.jerk};
  if (!held_heading_rad_) return velocity;
  const Changing level = without(velocity, up);
  const double speed = level.value.norm();
  const double slow = attitude_.slow_mps;
  if (speed >= slow) return velocity;
  double share = 0.0, share_rate = 0.0, share_second = 0.0;
  if (speed > 0.5 * slow) {
    const double x = 2.0 * speed / slow - 1.0;
    const double speed_rate = level.value.dot(level.rate) / speed;
    share = (10.0 + (6.0 * x - 15.0) * x) * x * x * x;
    share_rate = 30.0 * x * x * (1.0 - x) * (1.0 - x) * 2.0 * speed_rate / slow;
    const double speed_second =
        (level.rate.squaredNorm() + level.value.dot(level.second) - speed_rate * speed_rate) /
        speed;
    const double x_rate = 2.0 * speed_rate / slow;
    share_second = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) * x_rate * x_rate +
                   30.0 * x * x * (1.0 - x) * (1.0 - x) * 2.0 * speed_second / slow;
  }
  const Changing east = normalised(crossed(
      Changing{polar_axis_of(frame_), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}, up));
  const Changing north = crossed(up, east);
  const UniformSpline::Value heading = held_heading_rad_->at(time_s);
  const double sin = std::sin(heading.value), cos = std::cos(heading.value);
  const Eigen::Vector3d onward = cos * east.value - sin * north.value;
  const Eigen::Vector3d onward_rate = cos * east.rate - sin * north.rate;
  const Eigen::Vector3d course = sin * east.value + cos * north.value;
  const Changing held{
      slow * (sin * east.value + cos * north.value),
      slow * (sin * east.rate + cos * north.rate +
              heading.first * (cos * east.value - sin * north.value)),
      slow * (sin * east.second + cos * north.second + 2.0 * heading.first * onward_rate +
              heading.second * onward - heading.first * heading.first * course)};
  return {share * velocity.value + (1.0 - share) * held.value,
          share * velocity.rate + (1.0 - share) * held.rate +
              share_rate * (velocity.value - held.value),
          share * velocity.second + (1.0 - share) * held.second +
              2.0 * share_rate * (velocity.rate - held.rate) +
              share_second * (velocity.value - held.value)};
}

// Roll follows acceleration, whose own rate jumps where pieces of a path meet. Averaged over a time
// and taken as a spline of the time it is twice continuously differentiable, as a real roll is; a
// steady turn keeps its exact angle.
void Steering::make_roll(const std::function<PointMotion(double)>& motion, double duration_s,
                         bool is_closed) {
  const Sampling sampling = sampling_of(duration_s, attitude_.bank->smoothing_s);
  std::vector<double> roll_rad(sampling.num_intervals + (is_closed ? 0 : 1));
  for (std::size_t i = 0; i < roll_rad.size(); ++i) {
    const double time_s = std::min(static_cast<double>(i) * sampling.spacing_s, duration_s);
    const PointMotion now = motion(time_s);
    const Changing up = up_along(frame_, now.position, now.velocity, now.acceleration);
    const Eigen::Vector3d left =
        up.value.cross(direction_of_travel(time_s, now, up).value).normalized();
    // A turn to the left lowers the left wing: a negative turn about x forward.
    const double coordinated = -std::atan(now.acceleration.dot(left) / kGravity_mps2);
    roll_rad[i] = std::clamp(coordinated, -attitude_.bank->limit_rad, attitude_.bank->limit_rad);
  }
  const int reach =
      static_cast<int>(std::lround(0.5 * attitude_.bank->smoothing_s / sampling.spacing_s));
  roll_rad_.emplace(smoothed(roll_rad, reach, is_closed), duration_s, is_closed,
                    attitude_.continuity);
}

MotionState Steering::state_at(double time_s, const PointMotion& motion) const {
  const Changing up = up_along(frame_, motion.position, motion.velocity, motion.acceleration);
  Changing nose = direction_of_travel(time_s, motion, up);
  if (attitude_.nose == Attitude::Nose::TowardsPoint)
    nose = {attitude_.target_world - motion.position, -motion.velocity, -motion.acceleration};
  if (attitude_.nose == Attitude::Nose::AlongDirection)
    nose = {attitude_.direction_world, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  if (attitude_.nose != Attitude::Nose::AlongPath) nose = without(nose, up);
  const Changing forward = normalised(nose);
  const Changing left = normalised(crossed(up, forward));
  const Changing body_up = crossed(forward, left);
  const Turning turning = turning_of(forward, left, body_up);  // before the body rolls
  MotionState state;
  state.time_s = time_s;
  state.velocity_world_mps = motion.velocity;
  state.acceleration_world_mps2 = motion.acceleration;
  state.jerk_world_mps3 = motion.jerk;
  state.world_from_body.translation = motion.position;
  Eigen::Quaterniond rotation = turning.world_from_body;
  state.angular_velocity_body_radps = turning.angular_velocity_body_radps;
  state.angular_acceleration_body_radps2 = turning.angular_acceleration_body_radps2;
  if (roll_rad_) {
    const UniformSpline::Value roll = roll_rad_->at(time_s);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(roll.value, Eigen::Vector3d::UnitX()));
    rotation = rotation * turn;
    const Eigen::Vector3d turned = turn.conjugate() * state.angular_velocity_body_radps;
    state.angular_acceleration_body_radps2 =
        turn.conjugate() * state.angular_acceleration_body_radps2 -
        roll.first * Eigen::Vector3d::UnitX().cross(turned) +
        roll.second * Eigen::Vector3d::UnitX();
    state.angular_velocity_body_radps = turn.conjugate() * state.angular_velocity_body_radps +
                                        roll.first * Eigen::Vector3d::UnitX();
  }
  state.world_from_body.rotation = rotation.normalized();
  return state;
}

std::vector<double> Steering::knots_s() const {
  std::vector<double> knots_s;
  append_knots(held_heading_rad_, knots_s);
  append_knots(roll_rad_, knots_s);
  return knots_s;
}

}  // namespace terracast::geo
