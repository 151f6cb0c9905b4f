#pragma once

#include <Eigen/Core>
#include <vector>

#include "geo/paths/polynomial.h"

namespace terracast::geo {

/// The curve over time that passes through points at given times with the least integral of squared snap (the fourth
/// derivative). Its pieces are polynomials of degree 7. At points in between it is six times continuously
/// differentiable. Open: it begins and ends at rest, with velocity, acceleration and jerk 0. Closed: the last point is the first again, and there it is as
/// smooth as elsewhere. Threads: safe.
/// source   Mellinger and Kumar, Minimum snap trajectory generation and control for quadrotors (ICRA 2011); Richter, Bry
///          and Roy, Polynomial trajectory planning for aggressive quadrotor flight (ISRR 2013): the free derivatives of
///          the points in closed form
class LeastSnapCurve {
 public:
  struct Value {
    Eigen::Vector3d position, velocity, acceleration, jerk;
    Eigen::Vector3d snap;
  };
  /// points        two or more (closed: four or more, the last equal to the first), neighbours apart
  /// durations_s   of the pieces between them, positive
  /// accuracy      stationarity() at most 1e-10
  /// cost          5 us a point
  LeastSnapCurve(const std::vector<Eigen::Vector3d>& points, const std::vector<double>& durations_s,
                 bool is_closed);

  /// time_s   from 0 to duration_s(); outside the end pieces go on
  Value at(double time_s) const;
  double duration_s() const { return starts_s_.back(); }
  /// The times of the points.
  const std::vector<double>& knots_s() const { return starts_s_; }
  bool is_closed() const { return is_closed_; }

  std::size_t num_pieces() const { return pieces_.size(); }
  double piece_s(std::size_t piece) const { return starts_s_[piece + 1] - starts_s_[piece]; }
  /// The piece that a time falls into.
  std::size_t piece_at(double time_s) const;
  /// A coordinate of a piece by x, which goes from 0 to 1 over the piece: eight coefficients.
  Polynomial coordinate_of(std::size_t piece, int axis) const;
  /// The direction of travel along a piece by the same x, up to a positive factor: the velocity without its zeros at the
  /// curve's ends, where the body rests.
  Polynomial direction_of(std::size_t piece, int axis) const;

  /// Integral of the squared snap over the curve, m^2/s^7.
  double cost() const;
  /// Derivatives of cost() by the durations of the pieces, all other durations kept.
  std::vector<double> cost_slopes() const;
  /// The largest derivative of the cost by a free derivative at a point, as a share of the sum of its terms' sizes: 0
  /// where the cost is least.
  double stationarity() const;
  /// The same curve `factor` times slower, which is the one of least snap for the longer times.
  LeastSnapCurve slowed(double factor) const;

 private:
  /// Position and its first three derivatives by x at both ends; a column a coordinate.
  using Ends = Eigen::Matrix<double, 8, 3>;

  LeastSnapCurve() = default;
  void solve(const std::vector<Eigen::Vector3d>& points);
  Ends ends_of(std::size_t piece) const;

  std::vector<double> starts_s_;                        ///< one more than pieces
  std::vector<Eigen::Matrix<double, 8, 3>> pieces_;     ///< coefficients by x
  std::vector<Eigen::Matrix<double, 4, 3>> at_points_;  ///< position and three derivatives by time
  bool is_closed_ = false;
};

}  // namespace terracast::geo
