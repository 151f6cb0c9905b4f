#include "geo/paths/path_motion.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::geo {

PathMotion::PathMotion(std::shared_ptr<const Path> path, const WorldFrame& frame,
                       const std::vector<SpeedAt>& speeds, const Attitude& attitude, double laps)
    : path_(std::move(path)),
      arc_length_(path_),
      speeds_(speeds, attitude.continuity),
      laps_(laps),
      lap_s_(speeds_.duration_s()),
      steering_(
          frame, attitude, [this](double time_s) { return motion_at(time_s); }, lap_s_,
          path_->is_closed()) {
  TERRACAST_CHECK(path_->is_closed() || laps_ == 1.0, "{} laps of an open path", laps_);
}

// With s the length and c(u) the path, |c'| du/dt = ds/dt; the lines below are its derivatives.
PointMotion PathMotion::motion_at(double lap_time_s) const {
  const SpeedProfile::Value travelled = speeds_.at(lap_time_s);
  const PathPoint point = path_->at(arc_length_.parameter_at(travelled.length_m));
  const double metres_per_u = point.first.norm();
  const double u_rate = travelled.speed_mps / metres_per_u;
  const double stretch = point.first.dot(point.second) / metres_per_u;
  const double u_second = (travelled.acceleration_mps2 - u_rate * u_rate * stretch) / metres_per_u;
  const double stretch_rate =
      (point.second.squaredNorm() + point.first.dot(point.third) - stretch * stretch) /
      metres_per_u;
  const double u_third = (travelled.jerk_mps3 - stretch_rate * u_rate * u_rate * u_rate -
                          3.0 * stretch * u_rate * u_second) /
                         metres_per_u;
  return {point.position_world, point.first * u_rate,
          point.second * (u_rate * u_rate) + point.first * u_second,
          point.third * (u_rate * u_rate * u_rate) + 3.0 * u_rate * u_second * point.second +
              point.first * u_third};
}

MotionState PathMotion::at(double time_s) const {
  TERRACAST_CHECK(std::isfinite(time_s), "time {} s of a motion", time_s);
  double lap_time_s = time_s;
  if (path_->is_closed()) lap_time_s -= lap_s_ * std::floor(lap_time_s / lap_s_);
  const double inside_s = std::clamp(lap_time_s, 0.0, lap_s_);
  PointMotion motion = motion_at(inside_s);
  if (!path_->is_closed() && lap_time_s != inside_s)
    motion = motion.extended(lap_time_s - inside_s);
  MotionState state = steering_.state_at(path_->is_closed() ? inside_s : lap_time_s, motion);
  state.time_s = time_s;
  return state;
}

std::vector<double> PathMotion::knots_s() const {
  std::vector<double> of_lap = steering_.knots_s();
  for (const double u : path_->joints())
    of_lap.push_back(speeds_.time_at(arc_length_.length_at(u)));
  for (const double time_s : speeds_.knots_s()) of_lap.push_back(time_s);
  std::vector<double> knots_s;
  for (double lap_start_s = 0.0; lap_start_s < duration_s(); lap_start_s += lap_s_)
    for (const double time_s : of_lap)
      if (lap_start_s + time_s <= duration_s()) knots_s.push_back(lap_start_s + time_s);
  knots_s.push_back(0.0);
  knots_s.push_back(duration_s());  // within a lap, too
  return sorted_knots(std::move(knots_s));
}

}  // namespace terracast::geo
