#include "geo/paths/recorded_motion.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::geo {
namespace {

/// Of the steps between times that reach into a window: their number over the time that they take together. Times that
/// differ by turns, as of loggers, do not matter to it.
double mean_rate_hz(const std::vector<double>& times_s, const RecordedMotion::Window& window) {
  const auto begin = std::upper_bound(times_s.begin(), times_s.end(), window.begin_s);
  const auto end = std::lower_bound(times_s.begin(), times_s.end(), window.end_s);
  const auto first = begin == times_s.begin() ? begin : begin - 1;
  const auto last = end == times_s.end() ? end - 1 : end;
  return last > first ? static_cast<double>(last - first) / (*last - *first) : 0.0;
}

}  // namespace

RotationSpline::Value RotationSpline::at(double time_s) const {
  const InterpolatingSplineIn<4>::Value value = spline_.at(time_s);
  const Turning turning = turning_of_parts(value.value, value.first, value.second);
  return {turning.world_from_body, turning.angular_velocity_body_radps,
          turning.angular_acceleration_body_radps2};
}

PointMotion point_motion_at(const InterpolatingSpline& position, const Flattened& flattened,
                            double time_s) {
  const InterpolatingSpline::Value value = position.at(time_s);
  const PathPoint point =
      flattened.world_from_flattened({value.value, value.first, value.second, value.third});
  return {point.position_world, point.first, point.second, point.third};
}

RecordedMotion::RecordedMotion(const WorldFrame& frame, InterpolatingSpline position, Window window,
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

RecordedRates RecordedMotion::recorded_rates() const {
  RecordedRates rates{.fixes_hz = mean_rate_hz(position_.parameters(), window_),
                      .attitudes_hz = std::nullopt};
  if (const auto* rotation = std::get_if<RotationSpline>(&attitude_))
    rates.attitudes_hz = mean_rate_hz(rotation->knots_s(), window_);
  return rates;
}

MotionState RecordedMotion::at(double time_s) const {
  TERRACAST_CHECK(std::isfinite(time_s), "time {} s of a motion", time_s);
  const PointMotion motion = motion_at(time_s);
  MotionState state;
  if (const auto* steering = std::get_if<Steering>(&attitude_)) {
    state = steering->state_at(time_s, motion);
  } else {
    const RotationSpline::Value rotation =
        std::get<RotationSpline>(attitude_).at(window_.begin_s + time_s);
    state.world_from_body = {rotation.world_from_body, motion.position};
    state.velocity_world_mps = motion.velocity;
    state.acceleration_world_mps2 = motion.acceleration;
    state.jerk_world_mps3 = motion.jerk;
    state.angular_velocity_body_radps = rotation.angular_velocity_body_radps;
    state.angular_acceleration_body_radps2 = rotation.angular_acceleration_body_radps2;
  }
  state.time_s = time_s;
  return state;
}

std::vector<double> RecordedMotion::knots_s() const {
  std::vector<double> knots_s = {0.0, duration_s()};
  const auto add = [&](double time_s) {
    if (time_s > 0.0 && time_s < duration_s()) knots_s.push_back(time_s);
  };
  for (const double time_s : position_.parameters()) add(time_s - window_.begin_s);
  if (const auto* steering = std::get_if<Steering>(&attitude_)) {
    for (const double time_s : steering->knots_s()) add(time_s);
  } else {
    for (const double time_s : std::get<RotationSpline>(attitude_).knots_s())
      add(time_s - window_.begin_s);
  }
  return sorted_knots(std::move(knots_s));
}

}  // namespace terracast::geo
