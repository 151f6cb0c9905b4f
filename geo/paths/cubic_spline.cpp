#include "geo/paths/cubic_spline.h"

#include <algorithm>

#include "core/error.h"

namespace terracast::geo {
namespace {

/// Solves the tridiagonal system lower[i] x[i-1] + diagonal[i] x[i] + upper[i] x[i+1] = right[i]
/// (Thomas; the spline's systems are diagonally dominant, so no pivots are needed).
template <class Value>
std::vector<Value> solve_tridiagonal(const std::vector<double>& lower, std::vector<double> diagonal,
                                     const std::vector<double>& upper, std::vector<Value> right) {
  const std::size_t n = diagonal.size();
  for (std::size_t i = 1; i < n; ++i) {
    const double factor = lower[i] / diagonal[i - 1];
    diagonal[i] -= factor * upper[i - 1];
    right[i] -= factor * right[i - 1];
  }
  right[n - 1] /= diagonal[n - 1];
  for (std::size_t i = n - 1; i-- > 0;)
    right[i] = (right[i] - upper[i] * right[i + 1]) / diagonal[i];
  return right;
}

}  // namespace

// With h_i the step after point i and M_i the second derivatives, continuity of the first
// derivative at point i is h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (d_i -
// d_{i-1}), d the slopes of the chords.
template <int kDimensions>
CubicSplineIn<kDimensions>::CubicSplineIn(std::vector<double> parameters, std::vector<Point> points,
                                          bool is_closed)
    : parameters_(std::move(parameters)), points_(std::move(points)), is_closed_(is_closed) {
  const std::size_t n = points_.size();
  TERRACAST_CHECK(parameters_.size() == n && n >= (is_closed ? 4u : 2u), "{} points", n);
  std::vector<double> step(n - 1);
  std::vector<Point> slope(n - 1);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    step[i] = parameters_[i + 1] - parameters_[i];
    TERRACAST_CHECK(step[i] > 0.0, "parameter {} does not grow", i + 1);
    slope[i] = (points_[i + 1] - points_[i]) / step[i];
  }
  seconds_.assign(n, Point::Zero());
  if (!is_closed_) {
    if (n == 2) return;
    const std::size_t inner = n - 2;
    std::vector<double> lower(inner), diagonal(inner), upper(inner);
    std::vector<Point> right(inner);
    for (std::size_t k = 0; k < inner; ++k) {
      lower[k] = step[k];
      diagonal[k] = 2.0 * (step[k] + step[k + 1]);
      upper[k] = step[k + 1];
      right[k] = 6.0 * (slope[k + 1] - slope[k]);
    }
    const auto solved = solve_tridiagonal(lower, diagonal, upper, right);
    std::copy(solved.begin(), solved.end(), seconds_.begin() + 1);
    return;
  }
  // Closed: unknowns 0 .. m-1 in a ring. The corners of the matrix are a rank-one term
  // (Sherman and Morrison): A = T + w v^T with w = (gamma, 0 .., corner), v = (1, 0 .., corner /
  // gamma).
  const std::size_t m = n - 1;
  std::vector<double> lower(m), diagonal(m), upper(m);
  std::vector<Point> right(m);
  for (std::size_t k = 0; k < m; ++k) {
    const std::size_t before = (k + m - 1) % m;
    lower[k] = step[before];
    diagonal[k] = 2.0 * (step[before] + step[k]);
    upper[k] = step[k];
    right[k] = 6.0 * (slope[k] - slope[before]);
  }
  const double corner = step[m - 1];
  const double gamma = -diagonal[0];
  diagonal[0] -= gamma;
  diagonal[m - 1] -= corner * corner / gamma;
  std::vector<double> w(m, 0.0);
  w[0] = gamma;
  w[m - 1] = corner;
  const auto y = solve_tridiagonal(lower, diagonal, upper, right);
  const auto z = solve_tridiagonal(lower, diagonal, upper, w);
  const double last = corner / gamma;
  const Point factor = (y[0] + last * y[m - 1]) / (1.0 + z[0] + last * z[m - 1]);
  for (std::size_t k = 0; k < m; ++k) seconds_[k] = y[k] - factor * z[k];
  seconds_[m] = seconds_[0];
}

template <int kDimensions>
typename CubicSplineIn<kDimensions>::Value CubicSplineIn<kDimensions>::at(double u) const {
  const auto after = std::upper_bound(parameters_.begin() + 1, parameters_.end() - 1, u);
  const auto i = static_cast<std::size_t>(after - parameters_.begin()) - 1;
  const double h = parameters_[i + 1] - parameters_[i];
  const double b = (u - parameters_[i]) / h;
  const double a = 1.0 - b;
  const Point& m0 = seconds_[i];
  const Point& m1 = seconds_[i + 1];
  return {a * points_[i] + b * points_[i + 1] +
              (h * h / 6.0) * ((a * a - 1.0) * a * m0 + (b * b - 1.0) * b * m1),
          (points_[i + 1] - points_[i]) / h +
              (h / 6.0) * ((1.0 - 3.0 * a * a) * m0 + (3.0 * b * b - 1.0) * m1),
          a * m0 + b * m1, (m1 - m0) / h};
}

template class CubicSplineIn<3>;
template class CubicSplineIn<4>;

}  // namespace terracast::geo
