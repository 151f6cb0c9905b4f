#pragma once

#include <Eigen/Core>
#include <vector>

namespace terracast::geo {

/// A point of a path with its derivatives by the parameter. Where pieces of a path join, `third` is that
/// of the piece that follows.
struct PathPoint {
  Eigen::Vector3d position_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Vector3d second = Eigen::Vector3d::Zero();
  Eigen::Vector3d third = Eigen::Vector3d::Zero();
};

/// A curve in the world, twice continuously differentiable, over a parameter in [0, end()] that
/// grows by about one for each metre. Threads: safe.
class Path {
 public:
  virtual ~Path() = default;
  virtual PathPoint at(double u) const = 0;
  virtual double end() const = 0;
  /// The end joins the start with equal derivatives.
  virtual bool is_closed() const = 0;
  /// Parameters, increasing from 0 to end(), between which all derivatives are continuous.
  virtual std::vector<double> joints() const = 0;
};

}  // namespace terracast::geo
