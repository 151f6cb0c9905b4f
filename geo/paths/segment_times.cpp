#include "geo/paths/segment_times.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace terracast::geo {
namespace {

/// The place of the largest size of a vector of polynomials.
Extremum largest_of(const std::array<Polynomial, 3>& vector) {
  Polynomial squared;
  for (const Polynomial& coordinate : vector) add_to(squared, product_of(coordinate, coordinate));
  Extremum largest = greatest_of(squared, 0.0, 1.0);
  double sum = 0.0;
  for (const Polynomial& coordinate : vector) {
    const double value = value_of(coordinate, largest.x);
    sum += value * value;
  }
  largest.value = std::sqrt(sum);
  return largest;
}

double sum_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

std::vector<double> of_sum_one(std::vector<double> values) {
  const double sum = sum_of(values);
  for (double& value : values) value /= sum;
  return values;
}

/// log(cost) + 7 log(duration), which has the same value for a curve and a slower one, and its derivatives by the
/// logarithms of the durations.
struct Roughness {
  double value;
  Eigen::VectorXd slopes;
};

Roughness roughness_of(const LeastSnapCurve& curve) {
  const double cost = curve.cost(), whole_s = curve.duration_s();
  const std::vector<double> slopes = curve.cost_slopes();
  Roughness roughness{std::log(cost) + 7.0 * std::log(whole_s),
                      Eigen::VectorXd(static_cast<Eigen::Index>(slopes.size()))};
  for (std::size_t i = 0; i < slopes.size(); ++i)
    roughness.slopes[static_cast<Eigen::Index>(i)] =
        curve.piece_s(i) * (slopes[i] / cost + 7.0 / whole_s);
  return roughness;
}

/// Durations that sum up to one, changed by factors.
std::vector<double> changed(const std::vector<double>& durations,
                            const Eigen::VectorXd& log_factors) {
  std::vector<double> result(durations.size());
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = durations[i] * std::exp(log_factors[static_cast<Eigen::Index>(i)]);
  return of_sum_one(std::move(result));
}

/// Gradient descent with steps of Barzilai and Borwein, each halved until it descends.
std::vector<double> smoothest(const std::vector<Eigen::Vector3d>& points, bool is_closed,
                              std::vector<double> durations) {
  constexpr int kMostSteps = 200;
  constexpr double kEnoughSlope = 1e-6, kLargestChange = 0.5, kLeastStep = 1e-9;
  Roughness here = roughness_of({points, durations, is_closed});
  double step = 0.05;
  for (int i = 0; i < kMostSteps && here.slopes.lpNorm<Eigen::Infinity>() > kEnoughSlope; ++i) {
    step = std::min(step, kLargestChange / here.slopes.lpNorm<Eigen::Infinity>());
    while (step > kLeastStep) {
      const std::vector<double> tried = changed(durations, -step * here.slopes);
      const Roughness there = roughness_of({points, tried, is_closed});
      constexpr double kShareOfSlope = 1e-4;
      if (there.value <= here.value - kShareOfSlope * step * here.slopes.squaredNorm()) {
        const Eigen::VectorXd moved = -step * here.slopes, turned = there.slopes - here.slopes;
        const double curvature = moved.dot(turned);
        step = curvature > 0.0 ? moved.squaredNorm() / curvature : 2.0 * step;
        durations = tried;
        here = there;
        break;
      }
      step *= 0.5;
    }
    if (step <= kLeastStep) break;
  }
  return durations;
}

/// How much slower each piece of a curve would have to be.
std::vector<double> slowings_of(const LeastSnapCurve& curve, const MotionLimits& limits) {
  std::vector<double> slowings(curve.num_pieces());
  for (std::size_t i = 0; i < slowings.size(); ++i)
    slowings[i] = slowing_of(peaks_of(curve, i), limits);
  return slowings;
}

/// Shortens what falls short of the limits while the whole gets shorter, by smaller changes where it does not.
std::vector<double> shortest(const std::vector<Eigen::Vector3d>& points, bool is_closed,
                             const MotionLimits& limits, std::vector<double> durations) {
  constexpr int kMostRounds = 100;
  constexpr double kEnoughGain = 1e-3, kLeastPower = 0.02;
  std::vector<double> slowings = slowings_of({points, durations, is_closed}, limits);
  // Durations sum up to one: this is the time of the flight within the limits.
  double whole_s = *std::max_element(slowings.begin(), slowings.end());
  double power = 0.5;
  for (int round = 0; round < kMostRounds && power > kLeastPower; ++round) {
    Eigen::VectorXd log_factors(static_cast<Eigen::Index>(durations.size()));
    for (std::size_t i = 0; i < durations.size(); ++i)
      log_factors[static_cast<Eigen::Index>(i)] = power * std::log(slowings[i] / whole_s);
    const std::vector<double> tried = changed(durations, log_factors);
    const std::vector<double> there = slowings_of({points, tried, is_closed}, limits);
    const double tried_s = *std::max_element(there.begin(), there.end());
    if (tried_s < whole_s) {
      durations = tried;
      slowings = there;
      if (tried_s > (1.0 - kEnoughGain) * whole_s) power *= 0.5;
      whole_s = tried_s;
    } else {
      power *= 0.5;
    }
  }
  return durations;
}

}  // namespace

PiecePeaks peaks_of(const LeastSnapCurve& curve, std::size_t piece) {
  std::array<Polynomial, 3> vector;
  for (int axis = 0; axis < 3; ++axis)
    vector[static_cast<std::size_t>(axis)] = curve.coordinate_of(piece, axis);
  std::array<Peak, 3> peaks;
  double per_s = 1.0;
  for (Peak& peak : peaks) {
    for (Polynomial& coordinate : vector) coordinate = derivative_of(coordinate);
    per_s /= curve.piece_s(piece);
    const Extremum largest = largest_of(vector);
    peak = {largest.value * per_s, curve.knots_s()[piece] + largest.x * curve.piece_s(piece)};
  }
  return {peaks[0], peaks[1], peaks[2]};
}

double slowing_of(const PiecePeaks& peaks, const MotionLimits& limits) {
  return std::max({peaks.speed_mps.size / limits.speed_mps,
                   std::sqrt(peaks.acceleration_mps2.size / limits.acceleration_mps2),
                   std::cbrt(peaks.jerk_mps3.size / limits.jerk_mps3)});
}

LeastSnapCurve fit_within(const std::vector<Eigen::Vector3d>& points, bool is_closed,
                          const MotionLimits& limits, Timing timing) {
  std::vector<double> durations;
  for (std::size_t i = 0; i + 1 < points.size(); ++i)
    durations.push_back((points[i + 1] - points[i]).norm());
  durations = smoothest(points, is_closed, of_sum_one(std::move(durations)));
  if (timing == Timing::Shortest)
    durations = shortest(points, is_closed, limits, std::move(durations));
  const LeastSnapCurve curve(points, durations, is_closed);
  const std::vector<double> slowings = slowings_of(curve, limits);
  return curve.slowed(*std::max_element(slowings.begin(), slowings.end()));
}

}  // namespace terracast::geo
