#include "sensors/events/light_curve.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::sensors::events {
namespace {

/// The most that a cubic's derivative at its end may be over its mean slope: it stays monotone.
constexpr double kMostSlopes = 3.0;

double limited(double derivative, double slope) {
  if (!(derivative * slope > 0.0)) return 0.0;
  const double most = kMostSlopes * std::abs(slope);
  return std::clamp(derivative, -most, most);
}

/// An interval between two samples.
struct Step {
  double length_s;
  double slope;

  Step(const LightSample& from, const LightSample& to)
      : length_s(to.time_s - from.time_s), slope((to.log_light - from.log_light) / length_s) {}
};

/// The derivative at the sample between two steps.
double derivative_between(const Step& left, const Step& right) {
  const double parabola = (right.length_s * left.slope + left.length_s * right.slope) /
                          (left.length_s + right.length_s);
  return limited(limited(parabola, left.slope), right.slope);
}

/// The derivative at the outer end of a step.
double derivative_at_end(const Step& step, const Step& next) {
  const double parabola =
      step.slope + (step.slope - next.slope) * step.length_s / (step.length_s + next.length_s);
  return limited(parabola, step.slope);
}

/// phi_k(-z) = integral over s in [0, 1] of exp(-z (1 - s)) s^(k - 1) / (k - 1)!, k = 1 … 4.
std::array<double, 4> exponential_integrals(double z) {
  constexpr std::array<double, 4> kOverFactorial = {1.0, 1.0, 0.5, 1.0 / 6.0};
  std::array<double, 4> phi{};
  if (z >= 1.0) {
    double last = std::exp(-z);
    for (std::size_t k = 0; k < 4; ++k) phi[k] = last = (kOverFactorial[k] - last) / z;
    return phi;
  }
  // phi_4 by its series, and from it the others down, where nothing cancels.
  double term = 1.0 / 24.0;
  for (int j = 0; j < 20; ++j) {
    phi[3] += term;
    term *= -z / (j + 5);
  }
  for (std::size_t k = 3; k > 0; --k) phi[k - 1] = kOverFactorial[k] - z * phi[k];
  return phi;
}

}  // namespace

Cubic::Extrema Cubic::extrema() const {
  const auto& [a, b, c, d] = coefficients;
  Extrema extrema;
  const auto add = [&](double x) {
    if (x > 0.0 && x < length_s) extrema.x[extrema.count++] = x;
  };
  // b + 2 c x + 3 d x^2 = 0, by the form that does not cancel.
  const double root = c * c - 3.0 * d * b;
  if (!(root > 0.0)) return extrema;
  const double q = -(c + std::copysign(std::sqrt(root), c));
  if (d != 0.0) add(q / (3.0 * d));
  if (q != 0.0) add(b / q);
  if (extrema.count == 2 && extrema.x[0] > extrema.x[1]) std::swap(extrema.x[0], extrema.x[1]);
  return extrema;
}

void join_monotone(std::span<const LightSample> samples, const std::optional<LightSample>& before,
                   std::vector<Cubic>& curve) {
  TERRACAST_CHECK(samples.size() >= 2, "a curve through {} samples", samples.size());
  curve.clear();
  const std::size_t num_steps = samples.size() - 1;
  const auto step = [&](std::size_t i) { return Step(samples[i], samples[i + 1]); };
  const Step first = step(0);
  double derivative = first.slope;
  if (before)
    derivative = derivative_between(Step(*before, samples[0]), first);
  else if (num_steps > 1)
    derivative = derivative_at_end(first, step(1));
  for (std::size_t i = 0; i < num_steps; ++i) {
    const Step here = step(i);
    double next = here.slope;
    if (i + 1 < num_steps)
      next = derivative_between(here, step(i + 1));
    else if (i > 0)
      next = derivative_at_end(here, step(i - 1));
    else if (before)
      next = derivative_at_end(here, Step(*before, samples[0]));
    const double h = here.length_s;
    curve.push_back({.start_s = samples[i].time_s,
                     .length_s = h,
                     .coefficients = {samples[i].log_light, derivative,
                                      (3.0 * here.slope - 2.0 * derivative - next) / h,
                                      (derivative + next - 2.0 * here.slope) / (h * h)}});
    derivative = next;
  }
}

double Filtered::at(double x) const {
  if (rate_per_s_ == 0.0) return cubic_.at(x);
  const auto& [a, b, c, d] = cubic_.coefficients;
  const double z = rate_per_s_ * x;
  const std::array<double, 4> phi = exponential_integrals(z);
  return level_ + z * ((a - level_) * phi[0] +
                       x * (b * phi[1] + x * (2.0 * c * phi[2] + x * 6.0 * d * phi[3])));
}

std::optional<double> Filtered::turn_within(double from, double to) const {
  if (rate_per_s_ == 0.0) return std::nullopt;
  const auto lag = [this](double x) { return cubic_.at(x) - at(x); };
  const double lag_from = lag(from);
  const double lag_to = lag(to);
  if (!(lag_from * lag_to < 0.0)) return std::nullopt;
  const double turn = first_place_of(lag, 0.0, from, to);
  if (turn >= to) return std::nullopt;
  return turn;
}

}  // namespace terracast::sensors::events
