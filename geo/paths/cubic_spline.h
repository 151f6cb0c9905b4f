#pragma once

#include <Eigen/Core>
#include <vector>

namespace terracast::geo {

/// The interpolating cubic spline through points at increasing parameters: twice continuously
/// differentiable. Open: natural (second derivative 0 at the ends). Closed: the last point is the
/// first again, with equal derivatives.
class CubicSpline {
 public:
  struct Value {
    Eigen::Vector3d value;
    Eigen::Vector3d first;
    Eigen::Vector3d second;
  };

  /// parameters   increasing, as many as points, two or more; closed: four or more, last
  ///              point equal to the first
  CubicSpline(std::vector<double> parameters, std::vector<Eigen::Vector3d> points, bool is_closed);

  /// Outside the parameters the end pieces go on.
  Value at(double u) const;
  const std::vector<double>& parameters() const { return parameters_; }
  bool is_closed() const { return is_closed_; }

 private:
  std::vector<double> parameters_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Eigen::Vector3d> seconds_;  ///< second derivatives at the points
  bool is_closed_;
};

}  // namespace terracast::geo
