#include "geo/paths/path_motion.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::geo {

PathMotion::PathMotion(std::shared_ptr<const Path> path, const WorldFrame& frame,
                       const std::vector<SpeedAt>& speeds, const Attitude& attitude, double laps)
    : path_(std::move(path)),
      arc_length_(path_),
      speeds_(speeds),
      laps_(laps),
      lap_s_(speeds_.duration_s()),
      steering_(
          frame, attitude, [this](double time_s) { return motion_at(time_s); }, lap_s_,
          path_->is_closed()) {
  TERRACAST_CHECK(path_->is_closed() || laps_ == 1.0, "{} laps of an open path", laps_);
}

// With s the length and c(u) the path, |c'| du/dt = ds/dt; the second line is its derivative.
PointMotion PathMotion::motion_at(double lap_time_s) const {
  const SpeedProfile::Value travelled = speeds_.at(lap_time_s);
  const PathPoint point = path_->at(arc_length_.parameter_at(travelled.length_m));
  const double metres_per_u = point.first.norm();
  const double u_rate = travelled.speed_mps / metres_per_u;
  const double stretch = point.first.dot(point.second) / metres_per_u;
  const double u_second = (travelled.acceleration_mps2 - u_rate * u_rate * stretch) / metres_per_u;
  return {point.position_world, point.first * u_rate,
          point.second * (u_rate * u_rate) + point.first * u_second};
}

BodyState PathMotion::at(double time_s) const {
  constexpr double kTimeTolerance_s = 1e-9;
  TERRACAST_CHECK(time_s >= -kTimeTolerance_s && time_s <= duration_s() + kTimeTolerance_s,
                  "time {} s of a motion of {} s", time_s, duration_s());
  double lap_time_s = std::max(time_s, 0.0);
  if (path_->is_closed()) lap_time_s -= lap_s_ * std::floor(lap_time_s / lap_s_);
  lap_time_s = std::clamp(lap_time_s, 0.0, lap_s_);
  BodyState state = steering_.state_at(lap_time_s, motion_at(lap_time_s));
  state.time_s = time_s;
  return state;
}

}  // namespace terracast::geo
