#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace terracast::tiler {

/// Samples on a regular grid, row by row; sample (i, j) stands at grid coordinates (i, j).
template <class T>
struct Grid {
  int width = 0;
  int height = 0;
  std::vector<T> values;

  Grid() = default;
  Grid(int columns, int rows, T fill = T{})
      : width(columns),
        height(rows),
        values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), fill) {}

  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(i);
  }
  bool contains(int i, int j) const { return i >= 0 && j >= 0 && i < width && j < height; }
  T& operator()(int i, int j) { return values[index(i, j)]; }
  const T& operator()(int i, int j) const { return values[index(i, j)]; }
  /// The sample, or the nearest one of the border.
  const T& clamped(int i, int j) const {
    return values[index(std::clamp(i, 0, width - 1), std::clamp(j, 0, height - 1))];
  }
};

/// Weights of the Catmull-Rom spline at t in [0, 1] between the second and the third of four
/// samples: it passes through the samples, is once continuously differentiable, and reproduces
/// polynomials of degree two.
inline void catmull_rom_weights(double t, double (&weights)[4]) {
  const double t2 = t * t;
  const double t3 = t2 * t;
  weights[0] = 0.5 * (-t + 2.0 * t2 - t3);
  weights[1] = 0.5 * (2.0 - 5.0 * t2 + 3.0 * t3);
  weights[2] = 0.5 * (t + 4.0 * t2 - 3.0 * t3);
  weights[3] = 0.5 * (-t2 + t3);
}

/// Bicubic value at grid coordinates; beyond the border its samples are carried on.
template <class T>
double bicubic(const Grid<T>& grid, const Eigen::Vector2d& at) {
  const double x0 = std::floor(at.x());
  const double y0 = std::floor(at.y());
  double wx[4];
  double wy[4];
  catmull_rom_weights(at.x() - x0, wx);
  catmull_rom_weights(at.y() - y0, wy);
  const int i0 = static_cast<int>(x0) - 1;
  const int j0 = static_cast<int>(y0) - 1;
  double sum = 0.0;
  if (i0 >= 0 && j0 >= 0 && i0 + 3 < grid.width && j0 + 3 < grid.height) {
    const T* row = &grid.values[grid.index(i0, j0)];
    for (int j = 0; j < 4; ++j, row += grid.width)
      sum += wy[j] * (wx[0] * static_cast<double>(row[0]) + wx[1] * static_cast<double>(row[1]) +
                      wx[2] * static_cast<double>(row[2]) + wx[3] * static_cast<double>(row[3]));
    return sum;
  }
  for (int j = 0; j < 4; ++j)
    sum += wy[j] * (wx[0] * static_cast<double>(grid.clamped(i0, j0 + j)) +
                    wx[1] * static_cast<double>(grid.clamped(i0 + 1, j0 + j)) +
                    wx[2] * static_cast<double>(grid.clamped(i0 + 2, j0 + j)) +
                    wx[3] * static_cast<double>(grid.clamped(i0 + 3, j0 + j)));
  return sum;
}

/// Bilinear value at grid coordinates; beyond the border its samples are carried on.
template <class T>
double bilinear(const Grid<T>& grid, const Eigen::Vector2d& at) {
  const double x = std::clamp(at.x(), 0.0, static_cast<double>(grid.width - 1));
  const double y = std::clamp(at.y(), 0.0, static_cast<double>(grid.height - 1));
  const int i = std::min(static_cast<int>(x), std::max(grid.width - 2, 0));
  const int j = std::min(static_cast<int>(y), std::max(grid.height - 2, 0));
  const double tx = x - i;
  const double ty = y - j;
  const auto value = [&](int di, int dj) {
    return static_cast<double>(grid.clamped(i + di, j + dj));
  };
  const double south = value(0, 0) + tx * (value(1, 0) - value(0, 0));
  const double north = value(0, 1) + tx * (value(1, 1) - value(0, 1));
  return south + ty * (north - south);
}

}  // namespace terracast::tiler
