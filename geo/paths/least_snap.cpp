#include "geo/paths/least_snap.h"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::geo {
namespace {

using Matrix8d = Eigen::Matrix<double, 8, 8>;

/// Coefficients of the polynomial of degree 7 whose value and first three derivatives at 0 and at 1 are given, in this
/// order.
Matrix8d coefficients_from_ends() {
  Matrix8d matrix = Matrix8d::Zero();
  const Eigen::Vector4d factorials(1.0, 1.0, 2.0, 6.0);
  for (int k = 0; k < 4; ++k) matrix(k, k) = 1.0 / factorials[k];
  // What is left to reach at 1 of each derivative, by the coefficients of x^4 to x^7.
  Eigen::Matrix4d high;
  high << 35.0, -15.0, 2.5, -1.0 / 6.0,  //
      -84.0, 39.0, -7.0, 0.5,            //
      70.0, -34.0, 6.5, -0.5,            //
      -20.0, 10.0, -2.0, 1.0 / 6.0;
  matrix.bottomRightCorner<4, 4>() = high;
  Eigen::Matrix4d reached = Eigen::Matrix4d::Zero();  // at 1, by derivatives at 0
  for (int k = 0; k < 4; ++k)
    for (int m = k; m < 4; ++m) reached(k, m) = 1.0 / factorials[m - k];
  matrix.bottomLeftCorner<4, 4>() = -high * reached;
  return matrix;
}

/// The integral over x from 0 to 1 of the squared fourth derivative by x, as a form of the ends.
Matrix8d cost_of_ends() {
  const Eigen::Vector4d factors(24.0, 120.0, 360.0, 840.0);
  Eigen::Matrix4d of_coefficients;
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k) of_coefficients(i, k) = factors[i] * factors[k] / (i + k + 1);
  const Eigen::Matrix<double, 4, 8> high = coefficients_from_ends().bottomRows<4>();
  return high.transpose() * of_coefficients * high;
}

const Matrix8d& coefficients_matrix() {
  static const Matrix8d matrix = coefficients_from_ends();
  return matrix;
}

const Matrix8d& cost_matrix() {
  static const Matrix8d matrix = cost_of_ends();
  return matrix;
}

/// Derivatives by x from derivatives by a time in which x goes from 0 to 1: 1, T, T^2, T^3.
Eigen::Vector4d powers_of(double duration) {
  return {1.0, duration, duration * duration, duration * duration * duration};
}

double per_seventh(double duration_s) { return 1.0 / std::pow(duration_s, 7); }

}  // namespace

LeastSnapCurve::LeastSnapCurve(const std::vector<Eigen::Vector3d>& points,
                               const std::vector<double>& durations_s, bool is_closed)
    : is_closed_(is_closed) {
  const std::size_t n = points.size();
  TERRACAST_CHECK(durations_s.size() + 1 == n && n >= (is_closed ? 4u : 2u), "{} points", n);
  starts_s_.push_back(0.0);
  for (const double duration_s : durations_s) {
    TERRACAST_CHECK(duration_s > 0.0 && std::isfinite(duration_s), "a piece of {} s", duration_s);
    starts_s_.push_back(starts_s_.back() + duration_s);
  }
  solve(points);
  for (std::size_t i = 0; i + 1 < n; ++i) pieces_.emplace_back(coefficients_matrix() * ends_of(i));
}

LeastSnapCurve::Ends LeastSnapCurve::ends_of(std::size_t piece) const {
  const Eigen::Vector4d powers = powers_of(piece_s(piece));
  Ends ends;
  ends.topRows<4>() = powers.asDiagonal() * at_points_[piece];
  ends.bottomRows<4>() = powers.asDiagonal() * at_points_[piece + 1];
  return ends;
}

// The unknowns are the three derivatives at each free point, by a time of its own (the shorter of its pieces), which makes them of
// one size. The cost is a quadratic form of them, and zero its gradient: each point with itself and its two neighbours.
void LeastSnapCurve::solve(const std::vector<Eigen::Vector3d>& points) {
  const std::size_t n = points.size();
  at_points_.assign(n, Eigen::Matrix<double, 4, 3>::Zero());
  for (std::size_t i = 0; i < n; ++i) at_points_[i].row(0) = points[i].transpose();
  const std::size_t num_free = is_closed_ ? n - 1 : n - 2;
  if (num_free == 0) return;
  constexpr std::size_t kFixed = static_cast<std::size_t>(-1);
  const auto free_of = [&](std::size_t point) {  // its number among the free ones
    if (is_closed_) return point % num_free;
    return point == 0 || point + 1 == n ? kFixed : point - 1;
  };
  std::vector<double> times_s(num_free);
  for (std::size_t i = 0; i + 1 < n; ++i)
    for (const std::size_t end : {free_of(i), free_of(i + 1)})
      if (end != kFixed)
        times_s[end] = times_s[end] > 0.0 ? std::min(times_s[end], piece_s(i)) : piece_s(i);
  std::vector<Eigen::Triplet<double>> entries;
  const auto size = static_cast<Eigen::Index>(3 * num_free);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(size, 3);
  const double mean_s = duration_s() / static_cast<double>(n - 1);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double weight = per_seventh(piece_s(i) / mean_s);
    // Row k of an end: derivative k % 4 by x, which is the unknown times a power.
    const auto unknown_of = [&](int k) -> std::pair<Eigen::Index, double> {
      const std::size_t end = free_of(k < 4 ? i : i + 1);
      if (k % 4 == 0 || end == kFixed) return {-1, 0.0};
      return {static_cast<Eigen::Index>(3 * end) + k % 4 - 1,
              powers_of(piece_s(i) / times_s[end])[k % 4]};
    };
    for (int r = 0; r < 8; ++r) {
      const auto [row, row_power] = unknown_of(r);
      if (row < 0) continue;
      for (int c = 0; c < 8; ++c) {
        const double entry = weight * row_power * cost_matrix()(r, c);
        const auto [column, column_power] = unknown_of(c);
        if (column >= 0)
          entries.emplace_back(static_cast<int>(row), static_cast<int>(column),
                               entry * column_power);
      }
      // A piece's place does not matter, only how far apart its ends are.
      const double of_end = weight * row_power * cost_matrix()(r, 4);
      right.row(row) -= of_end * (points[i + 1] - points[i]).transpose();
    }
  }
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  TERRACAST_CHECK(solver.info() == Eigen::Success, "a curve of {} points is not solved", n);
  Eigen::MatrixXd solved = solver.solve(right);
  solved += solver.solve(right - matrix * solved);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t free = free_of(i);
    if (free == kFixed) continue;
    const Eigen::Vector4d powers = powers_of(1.0 / times_s[free]);
    for (int k = 1; k < 4; ++k)
      at_points_[i].row(k) = powers[k] * solved.row(static_cast<Eigen::Index>(3 * free) + k - 1);
  }
}

std::size_t LeastSnapCurve::piece_at(double time_s) const {
  const auto after = std::upper_bound(starts_s_.begin() + 1, starts_s_.end() - 1, time_s);
  return static_cast<std::size_t>(after - starts_s_.begin()) - 1;
}

LeastSnapCurve::Value LeastSnapCurve::at(double time_s) const {
  const std::size_t piece = piece_at(time_s);
  const double duration_s = piece_s(piece);
  const double x = (time_s - starts_s_[piece]) / duration_s;
  // Derivatives over their factorials, by Horner's scheme all at once.
  Eigen::Matrix<double, 5, 3> sums = Eigen::Matrix<double, 5, 3>::Zero();
  for (int k = 7; k >= 0; --k) {
    for (int m = 4; m > 0; --m) sums.row(m) = sums.row(m) * x + sums.row(m - 1);
    sums.row(0) = sums.row(0) * x + pieces_[piece].row(k);
  }
  const double rate = 1.0 / duration_s;
  return {sums.row(0).transpose(), rate * sums.row(1).transpose(),
          2.0 * rate * rate * sums.row(2).transpose(),
          6.0 * rate * rate * rate * sums.row(3).transpose(),
          24.0 * rate * rate * rate * rate * sums.row(4).transpose()};
}

Polynomial LeastSnapCurve::coordinate_of(std::size_t piece, int axis) const {
  Polynomial polynomial(8);
  for (std::size_t k = 0; k < 8; ++k)
    polynomial[k] = pieces_[piece](static_cast<Eigen::Index>(k), axis);
  return polynomial;
}

// The velocity is x^3 times the rest at the beginning, (1 - x)^3 times the rest at the end, and both times a constant where one
// piece is all.
Polynomial LeastSnapCurve::direction_of(std::size_t piece, int axis) const {
  Polynomial velocity = derivative_of(coordinate_of(piece, axis));
  if (is_closed_) return velocity;
  const bool is_first = piece == 0, is_last = piece + 1 == num_pieces();
  if (is_first && is_last) return {at_points_[1](0, axis) - at_points_[0](0, axis)};
  if (is_first) return {velocity.begin() + 3, velocity.end()};
  if (!is_last) return velocity;
  // Division by (1 - x)^3, from the lowest power on.
  for (int times = 0; times < 3; ++times) {
    for (std::size_t k = 1; k < velocity.size(); ++k) velocity[k] += velocity[k - 1];
    velocity.pop_back();
  }
  return velocity;
}

double LeastSnapCurve::cost() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < num_pieces(); ++i) {
    const Ends ends = ends_of(i);
    sum += per_seventh(piece_s(i)) * (ends.transpose() * cost_matrix() * ends).trace();
  }
  return sum;
}

// At the least cost the free derivatives do not change it to the first order: what is left is how the
// cost of a piece with these ends depends on its duration.
std::vector<double> LeastSnapCurve::cost_slopes() const {
  std::vector<double> slopes(num_pieces());
  for (std::size_t i = 0; i < num_pieces(); ++i) {
    const double duration_s = piece_s(i);
    const Ends ends = ends_of(i);
    Ends slope = ends;  // of T^k d, times T
    for (int k = 0; k < 8; ++k) slope.row(k) *= k % 4;
    const Eigen::Matrix<double, 3, 8> gradient = ends.transpose() * cost_matrix();
    slopes[i] = per_seventh(duration_s) / duration_s *
                (2.0 * (gradient * slope).trace() - 7.0 * (gradient * ends).trace());
  }
  return slopes;
}

double LeastSnapCurve::stationarity() const {
  const std::size_t n = at_points_.size();
  const auto each = is_closed_ ? n - 1 : n;
  std::vector<Eigen::Matrix<double, 3, 3>> sums(each, Eigen::Matrix3d::Zero()), sizes = sums;
  for (std::size_t i = 0; i < num_pieces(); ++i) {
    Ends ends = ends_of(i);
    const Eigen::RowVector3d start = ends.row(0);
    ends.row(0).setZero();
    ends.row(4) -= start;
    const Eigen::Vector4d powers = powers_of(piece_s(i)) * per_seventh(piece_s(i));
    for (int r = 0; r < 8; ++r) {
      if (r % 4 == 0) continue;
      const std::size_t point = (r < 4 ? i : i + 1) % each;
      for (int c = 0; c < 8; ++c) {
        const Eigen::RowVector3d term = powers[r % 4] * cost_matrix()(r, c) * ends.row(c);
        sums[point].row(r % 4 - 1) += term;
        sizes[point].row(r % 4 - 1) += term.cwiseAbs();
      }
    }
  }
  double most = 0.0;
  for (std::size_t i = is_closed_ ? 0 : 1; i < (is_closed_ ? n - 1 : n - 1); ++i)
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis)
        if (sizes[i](k, axis) > 0.0)
          most = std::max(most, std::abs(sums[i](k, axis)) / sizes[i].row(k).maxCoeff());
  return most;
}

LeastSnapCurve LeastSnapCurve::slowed(double factor) const {
  TERRACAST_CHECK(factor > 0.0 && std::isfinite(factor), "slowed {} times", factor);
  LeastSnapCurve slower = *this;
  for (double& start_s : slower.starts_s_) start_s *= factor;
  for (auto& point : slower.at_points_)
    for (int k = 1; k < 4; ++k) point.row(k) *= powers_of(1.0 / factor)[k];
  return slower;
}

}  // namespace terracast::geo
