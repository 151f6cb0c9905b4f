#include "geo/paths/interpolating_spline.h"

#include <Eigen/Sparse>
#include <Eigen/SparseLU>
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

template <int kDimensions>
InterpolatingSplineIn<kDimensions>::InterpolatingSplineIn(std::vector<double> parameters,
                                                          std::vector<Point> points, bool is_closed,
                                                          Continuity continuity)
    : parameters_(std::move(parameters)), points_(std::move(points)), is_closed_(is_closed) {
  const std::size_t n = points_.size();
  TERRACAST_CHECK(parameters_.size() == n && n >= (is_closed ? 4u : 2u), "{} points", n);
  for (std::size_t i = 0; i + 1 < n; ++i)
    TERRACAST_CHECK(parameters_[i + 1] > parameters_[i], "parameter {} does not grow", i + 1);
  seconds_.assign(n, Point::Zero());
  if (continuity == Continuity::Fourth)
    solve_quintic();
  else
    solve_cubic();
}

// With h_i the step after point i and M_i the second derivatives, continuity of the first
// derivative at point i is h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (d_i -
// d_{i-1}), d the slopes of the chords.
template <int kDimensions>
void InterpolatingSplineIn<kDimensions>::solve_cubic() {
  const std::size_t n = points_.size();
  std::vector<double> step(n - 1);
  std::vector<Point> slope(n - 1);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    step[i] = parameters_[i + 1] - parameters_[i];
    slope[i] = (points_[i + 1] - points_[i]) / step[i];
  }
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

// A quintic piece of length h from place, first and second derivative (p, v, a) at both ends has
//     third at its start   (60 d - (36 v0 + 24 v1) h + (-9 a0 + 3 a1) h^2) / h^3,   d = p1 - p0
//     third at its end     (60 d - (24 v0 + 36 v1) h + (-3 a0 + 9 a1) h^2) / h^3
//     fourth at its start  (-360 d + (192 v0 + 168 v1) h + (36 a0 - 24 a1) h^2) / h^4
//     fourth at its end    (360 d - (168 v0 + 192 v1) h + (-24 a0 + 36 a1) h^2) / h^4
// and both are to be continuous. Rows are scaled by powers of the steps, to entries of one size.
template <int kDimensions>
void InterpolatingSplineIn<kDimensions>::solve_quintic() {
  const std::size_t n = points_.size();
  const std::size_t num_unknown = is_closed_ ? n - 1 : n;  // pairs of v and a
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd right =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(2 * num_unknown), kDimensions);
  // Adds `sign` times the third (or fourth) derivative of a piece at one of its ends to a row.
  const auto add = [&](std::size_t row, std::size_t piece, bool is_end, bool is_fourth, double sign,
                       double scale) {
    const double h = parameters_[piece + 1] - parameters_[piece];
    const double per = sign * scale / (h * h * h * (is_fourth ? h : 1.0));
    const double near_v = is_fourth ? 192.0 : -36.0, far_v = is_fourth ? 168.0 : -24.0;
    const double near_a = is_fourth ? 36.0 : -9.0, far_a = is_fourth ? -24.0 : 3.0;
    // Seen from the end, odd derivatives of the place and of the sum change their signs.
    const double turned = is_end ? -1.0 : 1.0;
    const double of_sum = is_fourth ? 1.0 : turned;
    const auto from = static_cast<int>((is_end ? piece + 1 : piece) % num_unknown);
    const auto to = static_cast<int>((is_end ? piece : piece + 1) % num_unknown);
    const auto at = static_cast<int>(row);
    entries.emplace_back(at, 2 * from, of_sum * turned * near_v * h * per);
    entries.emplace_back(at, 2 * to, of_sum * turned * far_v * h * per);
    entries.emplace_back(at, 2 * from + 1, of_sum * near_a * h * h * per);
    entries.emplace_back(at, 2 * to + 1, of_sum * far_a * h * h * per);
    const double of_place = (is_fourth ? -360.0 : 60.0) * of_sum * turned;
    right.row(at) -= of_place * per * (points_[piece + 1] - points_[piece]).transpose();
  };
  for (std::size_t i = 0; i < num_unknown; ++i) {
    const bool is_first = i == 0 && !is_closed_, is_last = i + 1 == n;
    const std::size_t before = i > 0 ? i - 1 : n - 2;
    const double before_h = parameters_[before + 1] - parameters_[before];
    const double after_h = is_last ? before_h : parameters_[i + 1] - parameters_[i];
    if (is_first || is_last) {
      entries.emplace_back(static_cast<int>(2 * i), static_cast<int>(2 * i + 1), 1.0);
      const double h = is_first ? after_h : before_h;
      add(2 * i + 1, is_first ? i : before, is_last, true, 1.0, h * h * h);
      continue;
    }
    const double h = std::min(before_h, after_h);
    add(2 * i, before, true, false, 1.0, h * h);
    add(2 * i, i, false, false, -1.0, h * h);
    add(2 * i + 1, before, true, true, 1.0, h * h * h);
    add(2 * i + 1, i, false, true, -1.0, h * h * h);
  }
  Eigen::SparseMatrix<double> matrix(right.rows(), right.rows());
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseLU<Eigen::SparseMatrix<double>> solver(matrix);
  TERRACAST_CHECK(solver.info() == Eigen::Success, "a spline of {} points is not solved", n);
  const Eigen::MatrixXd solved = solver.solve(right);
  firsts_.assign(n, Point::Zero());
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(2 * (i % num_unknown));
    firsts_[i] = solved.row(row).transpose();
    seconds_[i] = solved.row(row + 1).transpose();
  }
}

template <int kDimensions>
typename InterpolatingSplineIn<kDimensions>::Value InterpolatingSplineIn<kDimensions>::at(
    double u) const {
  const auto after = std::upper_bound(parameters_.begin() + 1, parameters_.end() - 1, u);
  const auto i = static_cast<std::size_t>(after - parameters_.begin()) - 1;
  const double h = parameters_[i + 1] - parameters_[i];
  if (!firsts_.empty()) {
    const double t = u - parameters_[i];
    const Point d = points_[i + 1] - points_[i];
    const Point& v0 = firsts_[i];
    const Point& v1 = firsts_[i + 1];
    const Point& a0 = seconds_[i];
    const Point& a1 = seconds_[i + 1];
    const Point c3 =
        (10.0 * d - (6.0 * v0 + 4.0 * v1) * h + (0.5 * a1 - 1.5 * a0) * (h * h)) / (h * h * h);
    const Point c4 =
        ((8.0 * v0 + 7.0 * v1) * h - 15.0 * d + (1.5 * a0 - a1) * (h * h)) / (h * h * h * h);
    const Point c5 =
        (6.0 * d - 3.0 * (v0 + v1) * h + 0.5 * (a1 - a0) * (h * h)) / (h * h * h * h * h);
    return {points_[i] + t * (v0 + t * (0.5 * a0 + t * (c3 + t * (c4 + t * c5)))),
            v0 + t * (a0 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
            a0 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
            6.0 * c3 + t * (24.0 * c4 + t * 60.0 * c5)};
  }
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

template class InterpolatingSplineIn<3>;
template class InterpolatingSplineIn<4>;

}  // namespace terracast::geo
