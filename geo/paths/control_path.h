#pragma once

#include <Eigen/Core>
#include <vector>

#include "geo/paths/flattened.h"
#include "geo/paths/path.h"
#include "geo/paths/uniform_spline.h"

namespace terracast::geo {

/// An open path drawn by evenly spaced controls in flattened coordinates: a B-spline, straight where
/// the controls are, everywhere within the hull of the nearest (four of a cubic one, six of a
/// quintic), and no steeper than the steepest step between two controls.
class ControlPath final : public Path {
 public:
  /// controls     two or more
  /// spacing_m    about what lies between two of them
  ControlPath(const Flattened& flattened, const std::vector<Eigen::Vector3d>& controls,
              double spacing_m, Continuity continuity = Continuity::Second);

  PathPoint at(double u) const override;
  double end() const override { return end_; }
  bool is_closed() const override { return false; }
  std::vector<double> joints() const override;

 private:
  Flattened flattened_;
  double end_;
  UniformSpline x_, y_, w_;
};

/// Raises heights until no step between neighbours is larger than `most_step`.
void limit_steps(std::vector<double>& heights, double most_step);

}  // namespace terracast::geo
