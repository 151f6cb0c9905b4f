#include "scene/water/rough_water.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace terracast::scene {
namespace {

double density(double x) { return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi); }
double below(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

/// Integral of (cotangent + x) density(x) from -cotangent to x, both in deviations.
double seen_up_to(double x, double cotangent) {
  return cotangent * (below(x) - below(-cotangent)) + density(cotangent) - density(x);
}

constexpr double kFarthest = 4.0;  ///< deviations
constexpr int kHalvings = 14;

}  // namespace

double seen_slopes_below(double slope, double deviation, double cotangent) {
  const double turned = cotangent / deviation;
  const double x = slope / deviation;
  if (x <= -turned) return 0.0;
  const double all = turned * below(turned) + density(turned);
  return std::min(seen_up_to(x, turned) / all, 1.0);
}

double seen_slope(double share, double deviation, double cotangent) {
  // So far turned away nothing is left to draw from: the steepest facets are seen.
  const double turned = std::max(cotangent / deviation, 0.5 - kFarthest);
  double low = std::max(-turned, -kFarthest);
  double high = kFarthest;
  const double from = seen_up_to(low, turned);
  const double wanted = from + share * (seen_up_to(high, turned) - from);
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (seen_up_to(middle, turned) < wanted ? low : high) = middle;
  }
  return deviation * 0.5 * (low + high);
}

}  // namespace terracast::scene
