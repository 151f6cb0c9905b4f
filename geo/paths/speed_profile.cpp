#include "geo/paths/speed_profile.h"

#include <algorithm>

#include "core/error.h"

namespace terracast::geo {

SpeedProfile::SpeedProfile(const std::vector<SpeedAt>& speeds, Continuity continuity)
    : continuity_(continuity) {
  TERRACAST_CHECK(speeds.size() >= 2);
  for (std::size_t i = 0; i + 1 < speeds.size(); ++i) {
    const double distance_m = speeds[i + 1].length_m - speeds[i].length_m;
    TERRACAST_CHECK(distance_m > 0.0 && speeds[i].speed_mps > 0.0 && speeds[i + 1].speed_mps > 0.0);
    // The smooth step is symmetric: the mean speed is the mean of both.
    legs_.push_back(
        {.start_s = legs_.empty() ? 0.0 : duration_s(),
         .duration_s = 2.0 * distance_m / (speeds[i].speed_mps + speeds[i + 1].speed_mps),
         .start_m = speeds[i].length_m,
         .start_mps = speeds[i].speed_mps,
         .end_mps = speeds[i + 1].speed_mps});
  }
}

SpeedProfile::Value SpeedProfile::at(double time_s) const {
  const auto after = std::upper_bound(legs_.begin() + 1, legs_.end(), time_s,
                                      [](double t, const Leg& leg) { return t < leg.start_s; });
  const Leg& leg = *(after - 1);
  const double t = time_s - leg.start_s;
  const double x = t / leg.duration_s;
  const double change_mps = leg.end_mps - leg.start_mps;
  if (continuity_ == Continuity::Fourth) {
    const double x2 = x * x, x4 = x2 * x2, y = 1.0 - x;
    const double T = leg.duration_s;
    return {leg.start_m + leg.start_mps * t +
                change_mps * T * x4 * x * (7.0 + x * (x * (10.0 - 2.5 * x) - 14.0)),
            leg.start_mps + change_mps * x4 * (35.0 + x * (x * (70.0 - 20.0 * x) - 84.0)),
            change_mps / T * 140.0 * x2 * x * y * y * y,
            change_mps / (T * T) * 420.0 * x2 * y * y * (1.0 - 2.0 * x)};
  }
  return {leg.start_m + leg.start_mps * t +
              change_mps * leg.duration_s * (x * x * x - 0.5 * x * x * x * x),
          leg.start_mps + change_mps * (3.0 - 2.0 * x) * x * x,
          change_mps / leg.duration_s * 6.0 * x * (1.0 - x),
          change_mps / (leg.duration_s * leg.duration_s) * 6.0 * (1.0 - 2.0 * x)};
}

double SpeedProfile::time_at(double length_m) const {
  double before_s = 0.0, after_s = duration_s();
  for (int i = 0; i < 60; ++i) {
    const double middle_s = 0.5 * (before_s + after_s);
    (at(middle_s).length_m < length_m ? before_s : after_s) = middle_s;
  }
  return after_s;
}

std::vector<double> SpeedProfile::knots_s() const {
  std::vector<double> knots;
  for (const Leg& leg : legs_) knots.push_back(leg.start_s);
  knots.push_back(duration_s());
  return knots;
}

}  // namespace terracast::geo
