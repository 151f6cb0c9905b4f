#pragma once

#include <Eigen/Core>
#include <vector>

namespace terracast::geo {

/// The interpolating cubic spline through points at increasing parameters: twice continuously
/// differentiable. Open: natural (second derivative 0 at the ends). Closed: the last point is the
/// first again, with equal derivatives.
template <int kDimensions>
class CubicSplineIn {
 public:
  using Point = Eigen::Matrix<double, kDimensions, 1>;
  struct Value {
    Point value;
    Point first;
    Point second;
    Point third;  ///< constant between two parameters; at one of them, that of the piece after it
  };

  /// parameters   increasing, as many as points, two or more; closed: four or more, last
  ///              point equal to the first
  CubicSplineIn(std::vector<double> parameters, std::vector<Point> points, bool is_closed);

  /// Outside the parameters the end pieces go on.
  Value at(double u) const;
  const std::vector<double>& parameters() const { return parameters_; }
  bool is_closed() const { return is_closed_; }

 private:
  std::vector<double> parameters_;
  std::vector<Point> points_;
  std::vector<Point> seconds_;  ///< second derivatives at the points
  bool is_closed_;
};

using CubicSpline = CubicSplineIn<3>;

extern template class CubicSplineIn<3>;
extern template class CubicSplineIn<4>;

}  // namespace terracast::geo
