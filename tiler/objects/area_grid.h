#pragma once

#include <Eigen/Core>
#include <vector>

#include "tiler/objects/rules.h"

namespace terracast::tiler {

/// A grid of places in an area, along its main direction and about its middle: those whose own rectangle lies in it.
/// half_along_m, half_across_m   half the sides of that rectangle
/// visit                         of (place, direction, row, column, num_rows, num_columns)
template <class Visit>
void visit_grid(const std::vector<PointsWorld>& rings, double along_step_m, double across_step_m,
                double half_along_m, double half_across_m, const Visit& visit) {
  const Eigen::Vector2d direction = main_direction(rings.front());
  const Eigen::Vector2d left(-direction.y(), direction.x());
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300);
  Eigen::Vector2d high = Eigen::Vector2d::Constant(-1e300);
  for (const Eigen::Vector2d& at : rings.front()) {
    const Eigen::Vector2d own(at.dot(direction), at.dot(left));
    low = low.cwiseMin(own);
    high = high.cwiseMax(own);
  }
  if ((high - low).maxCoeff() > 20000.0) return;
  const auto count = [](double size, double half, double step) {
    return size < 2.0 * half ? 0 : 1 + static_cast<int>((size - 2.0 * half) / step);
  };
  const int columns = count(high.x() - low.x(), half_along_m, along_step_m);
  const int rows = count(high.y() - low.y(), half_across_m, across_step_m);
  // In the middle of the area.
  const Eigen::Vector2d first =
      0.5 * (low + high) -
      0.5 * Eigen::Vector2d((columns - 1) * along_step_m, (rows - 1) * across_step_m);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d own =
          first + Eigen::Vector2d(column * along_step_m, row * across_step_m);
      bool fits = true;
      for (const double x : {-1.0, 0.0, 1.0})
        for (const double y : {-1.0, 0.0, 1.0})
          fits = fits && is_inside(rings, (own.x() + 0.98 * x * half_along_m) * direction +
                                              (own.y() + 0.98 * y * half_across_m) * left);
      if (fits) visit(own.x() * direction + own.y() * left, direction, row, column, rows, columns);
    }
}

}  // namespace terracast::tiler
