#include "tests/jobs/recorded_flight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace terracast::test {

namespace {

/// What the pilot commands for a while.
struct Wish {
  double until_s = 0.0;
  double speed_mps = 0.0;
  double climb_mps = 0.0;
  double turn_radps = 0.0;
};

/// A value goes to another by a step at most.
double toward(double value, double wanted, double step) {
  return value + std::clamp(wanted - value, -step, step);
}

}  // namespace

std::string draw_log(Draws& draws, const HandFlight& flight) {
  // A fix each third of a frame to each second one, at most 4000 of them.
  const double fix_s =
      std::max(flight.frame_s * draws.log_between(0.3, 2.0), flight.duration_s / 4000.0);
  // From rest to full speed within a third of a frame to five frames.
  const double start_s = flight.frame_s * draws.log_between(0.3, 5.0);
  const double most_turn_radps = draws.between(0.1, 0.5) / flight.frame_s;
  constexpr int kStepsPerFix = 16;
  const double step_s = fix_s / kStepsPerFix;
  std::string text = "time_s,x,y,z,yaw,pitch,roll\n";
  double x_m = 0.0, y_m = 0.0, z_m = 0.0, speed_mps = 0.0, climb_mps = 0.0, turn_radps = 0.0;
  double yaw_rad = draws.between(0.0, 2.0 * std::numbers::pi);
  Wish wish;
  const double end_s = flight.duration_s + 6.0 * fix_s;
  const auto num_steps = static_cast<int>(std::ceil(end_s / step_s));
  for (int step = 0; step <= num_steps; ++step) {
    const double time_s = step * step_s;
    if (time_s >= wish.until_s) {
      wish = {.until_s = time_s + flight.frame_s * draws.log_between(1.0, 12.0)};
      enum Kind { kHover, kGo, kTurnOnTheSpot, kClimb, kCurve };
      const int kind = draws.weighted({2.0, 3.0, 1.0, 1.0, 1.0});
      if (kind == kGo || kind == kCurve)
        wish.speed_mps = flight.speed_mps * draws.log_between(0.2, 1.0);
      if (kind == kTurnOnTheSpot || kind == kCurve)
        wish.turn_radps = draws.both_ways(most_turn_radps);
      if (kind == kClimb)
        wish.climb_mps = (z_m > 0.0 ? -1.0 : 1.0) *
                         std::min(0.5 * flight.speed_mps, flight.climb_m / flight.duration_s);
    }
    if (step % kStepsPerFix == 0)
      text += fmt::format("{:.6f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f}\n", time_s, x_m, y_m,
                          z_m, yaw_rad * 180.0 / std::numbers::pi,
                          -8.0 * speed_mps / std::max(flight.speed_mps, 1e-9), 0.0);
    speed_mps = toward(speed_mps, wish.speed_mps, flight.speed_mps * step_s / start_s);
    climb_mps = toward(climb_mps, wish.climb_mps, flight.speed_mps * step_s / start_s);
    turn_radps = toward(turn_radps, wish.turn_radps, most_turn_radps * step_s / start_s);
    yaw_rad += turn_radps * step_s;
    x_m += speed_mps * std::sin(yaw_rad) * step_s;
    y_m += speed_mps * std::cos(yaw_rad) * step_s;
    z_m += climb_mps * step_s;
  }
  return text;
}

}  // namespace terracast::test
