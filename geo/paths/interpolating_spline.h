#pragma once

#include <Eigen/Core>
#include <vector>

#include "geo/paths/continuity.h"

namespace terracast::geo {

/// The interpolating spline through points at increasing parameters: cubic, twice continuously
/// differentiable, or quintic, four times. Open: the second derivative is 0 at the ends, and the
/// quintic's fourth. Closed: the last point is the first again, with equal derivatives.
template <int kDimensions>
class InterpolatingSplineIn {
 public:
  using Point = Eigen::Matrix<double, kDimensions, 1>;
  struct Value {
    Point value;
    Point first;
    Point second;
    Point third;  ///< where it jumps, that of the piece that follows
  };

  /// parameters   increasing, as many as points, two or more; closed: four or more, last
  ///              point equal to the first
  InterpolatingSplineIn(std::vector<double> parameters, std::vector<Point> points, bool is_closed,
                        Continuity continuity = Continuity::Second);

  /// Outside the parameters the end pieces go on.
  Value at(double u) const;
  const std::vector<double>& parameters() const { return parameters_; }
  bool is_closed() const { return is_closed_; }

 private:
  void solve_cubic();
  void solve_quintic();

  std::vector<double> parameters_;
  std::vector<Point> points_;
  std::vector<Point> firsts_;   ///< first derivatives at the points, of quintic splines
  std::vector<Point> seconds_;  ///< second derivatives at the points
  bool is_closed_;
};

using InterpolatingSpline = InterpolatingSplineIn<3>;

extern template class InterpolatingSplineIn<3>;
extern template class InterpolatingSplineIn<4>;

}  // namespace terracast::geo
