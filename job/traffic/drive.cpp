#include "job/traffic/drive.h"

#include <algorithm>
#include <cmath>

namespace terracast::job {
namespace {

constexpr double kStep_m = 1.0;
/// Curvature is looked at so often a step, so that no bend is missed (points of paths are farther apart).
constexpr int kLooks = 4;
constexpr double kSlowest_mps = 0.3;

}  // namespace

Drive::Drive(const PathCurve& curve, const DriveStyle& style) {
  const int num_steps = std::max(1, static_cast<int>(std::ceil(curve.length_m() / kStep_m)));
  step_m_ = curve.length_m() / num_steps;
  speeds_mps_.assign(static_cast<std::size_t>(num_steps) + 1, 1e9);
  for (int look = 0; look <= kLooks * num_steps; ++look) {
    const PathCurve::Place place = curve.at(std::min(look * step_m_ / kLooks, curve.length_m()));
    const double bend_mps =
        std::sqrt(style.lateral_mps2 / std::max(std::abs(place.curvature_per_m), 1e-9));
    const double most_mps = std::max(std::min(place.limit_mps, bend_mps), kSlowest_mps);
    // It bounds the speeds at both ends of its step, and so all between.
    for (const int end : {look / kLooks, (look + kLooks - 1) / kLooks}) {
      double& speed = speeds_mps_[static_cast<std::size_t>(end)];
      speed = std::min(speed, most_mps);
    }
  }
  hold_limits(style.length_m);
  for (std::size_t i = speeds_mps_.size() - 1; i-- > 0;)
    speeds_mps_[i] = std::min(speeds_mps_[i], std::sqrt(speeds_mps_[i + 1] * speeds_mps_[i + 1] +
                                                        2.0 * style.brake_mps2 * step_m_));
  for (std::size_t i = 1; i < speeds_mps_.size(); ++i)
    speeds_mps_[i] = std::min(speeds_mps_[i], std::sqrt(speeds_mps_[i - 1] * speeds_mps_[i - 1] +
                                                        2.0 * style.accelerate_mps2 * step_m_));
  times_s_ = {0.0};
  for (std::size_t i = 1; i < speeds_mps_.size(); ++i)
    times_s_.push_back(times_s_.back() + 2.0 * step_m_ / (speeds_mps_[i - 1] + speeds_mps_[i]));
}

void Drive::hold_limits(double length_m) {
  const auto reach = static_cast<std::size_t>(std::ceil(length_m / step_m_));
  if (reach == 0) return;
  const std::vector<double> own = speeds_mps_;
  for (std::size_t i = 0; i < own.size(); ++i)
    for (std::size_t k = i - std::min(i, reach); k < i; ++k)
      speeds_mps_[i] = std::min(speeds_mps_[i], own[k]);
}

double Drive::time_s(double at_m) const {
  const auto last = speeds_mps_.size() - 2;
  const auto i = std::min(static_cast<std::size_t>(std::max(at_m, 0.0) / step_m_), last);
  const double in_m = at_m - static_cast<double>(i) * step_m_;
  const double from = speeds_mps_[i], to = speeds_mps_[i + 1];
  const double here =
      std::sqrt(std::max(from * from + (to * to - from * from) * in_m / step_m_, 0.0));
  return times_s_[i] + 2.0 * in_m / (from + here);
}

Drive::Progress Drive::at(double time_s) const {
  const auto after = std::upper_bound(times_s_.begin() + 1, times_s_.end() - 1, time_s);
  const auto i = static_cast<std::size_t>(after - times_s_.begin()) - 1;
  const double from = speeds_mps_[i], to = speeds_mps_[i + 1];
  const double acceleration = (to * to - from * from) / (2.0 * step_m_);
  const double in_s = time_s - times_s_[i];
  return {.at_m = static_cast<double>(i) * step_m_ + in_s * (from + 0.5 * acceleration * in_s),
          .speed_mps = from + acceleration * in_s,
          .acceleration_mps2 = acceleration};
}

}  // namespace terracast::job
