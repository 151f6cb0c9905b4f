#include "geo/paths/control_path.h"

#include <algorithm>

namespace terracast::geo {
namespace {

UniformSpline spline_of(const std::vector<Eigen::Vector3d>& controls, int axis, double end,
                        Continuity continuity) {
  std::vector<double> values;
  for (const Eigen::Vector3d& control : controls) values.push_back(control[axis]);
  return {std::move(values), end, false, continuity};
}

}  // namespace

ControlPath::ControlPath(const Flattened& flattened, const std::vector<Eigen::Vector3d>& controls,
                         double spacing_m, Continuity continuity)
    : flattened_(flattened),
      end_(static_cast<double>(controls.size() - 1) * spacing_m),
      x_(spline_of(controls, 0, end_, continuity)),
      y_(spline_of(controls, 1, end_, continuity)),
      w_(spline_of(controls, 2, end_, continuity)) {}

PathPoint ControlPath::at(double u) const {
  const UniformSpline::Value x = x_.at(u), y = y_.at(u), w = w_.at(u);
  return flattened_.world_from_flattened({{x.value, y.value, w.value},
                                          {x.first, y.first, w.first},
                                          {x.second, y.second, w.second},
                                          {x.third, y.third, w.third}});
}

std::vector<double> ControlPath::joints() const {
  std::vector<double> joints;
  for (std::size_t i = 0; i < x_.num_intervals(); ++i)
    joints.push_back(static_cast<double>(i) * x_.spacing());
  joints.push_back(end_);
  return joints;
}

void limit_steps(std::vector<double>& heights, double most_step) {
  for (std::size_t i = 1; i < heights.size(); ++i)
    heights[i] = std::max(heights[i], heights[i - 1] - most_step);
  for (std::size_t i = heights.size(); i-- > 1;)
    heights[i - 1] = std::max(heights[i - 1], heights[i] - most_step);
}

}  // namespace terracast::geo
