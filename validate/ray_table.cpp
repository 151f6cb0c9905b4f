#include "validate/ray_table.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Keys's kernel at a distance, for a = -1/2.
double keys(double distance) {
  const double t = std::abs(distance);
  if (t < 1.0) return (1.5 * t - 2.5) * t * t + 1.0;
  if (t < 2.0) return ((-0.5 * t + 2.5) * t - 4.0) * t + 2.0;
  return 0.0;
}

}  // namespace

RayTable::RayTable(const std::vector<double>& p)
    : CameraPlane("tabulated", p), columns_(static_cast<int>(p[0])), rows_(static_cast<int>(p[1])) {
  const std::size_t num_nodes =
      static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  if (columns_ != p[0] || rows_ != p[1] || p.size() != 2 + 3 * num_nodes)
    fail(ErrorKind::Input,
         "camera model tabulated: {} columns, {} rows and {} numbers of rays; three a node are "
         "right",
         p[0], p[1], p.size() - 2);
  nodes_.reserve(num_nodes);
  for (std::size_t i = 2; i < p.size(); i += 3) {
    const Vector3d ray(p[i], p[i + 1], p[i + 2]);
    if (!(ray.norm() > 1e-12 && ray.norm() < 1e12))
      fail(ErrorKind::Input, "camera model tabulated: ray {} has the length {}", nodes_.size(),
           ray.norm());
    nodes_.push_back(ray.normalized());
  }
}

bool RayTable::holds(const Vector2d& place) const {
  return place.x() >= -0.5 && place.x() <= columns_ - 0.5 && place.y() >= -0.5 &&
         place.y() <= rows_ - 0.5;
}

Vector3d RayTable::node(int column, int row) const {
  const auto stored = [&](int i, int j) -> const Vector3d& {
    return nodes_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(i)];
  };
  /// On a straight line through the two outer ones, so many steps beyond the last.
  const auto beyond = [](const Vector3d& last, const Vector3d& inner, int steps) {
    return Vector3d(last + steps * (last - inner));
  };
  const auto in_row = [&](int j) -> Vector3d {
    if (column < 0) return beyond(stored(0, j), stored(1, j), -column);
    if (column >= columns_)
      return beyond(stored(columns_ - 1, j), stored(columns_ - 2, j), column - columns_ + 1);
    return stored(column, j);
  };
  if (row < 0) return beyond(in_row(0), in_row(1), -row);
  if (row >= rows_) return beyond(in_row(rows_ - 1), in_row(rows_ - 2), row - rows_ + 1);
  return in_row(row);
}

Vector3d RayTable::joined(const Vector2d& place) const {
  const int column = std::clamp(static_cast<int>(std::floor(place.x())), -1, columns_ - 1);
  const int row = std::clamp(static_cast<int>(std::floor(place.y())), -1, rows_ - 1);
  Vector3d sum = Vector3d::Zero();
  for (int j = row - 1; j <= row + 2; ++j) {
    const double down = keys(place.y() - j);
    for (int i = column - 1; i <= column + 2; ++i) sum += keys(place.x() - i) * down * node(i, j);
  }
  return sum;
}

Vector3d RayTable::ray_from_place(const Vector2d& place) const {
  if (!holds(place)) return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Vector3d ray = joined(place).normalized();  // as it is where nodes cancel
  constexpr double kNear = 1e-9;
  return std::abs(ray.norm() - 1.0) < kNear
             ? ray
             : Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

// A coarse look over the whole table, and from its best node uphill.
Vector2d RayTable::nearest(const Vector3d& direction) const {
  const int stride_x = std::max(1, columns_ / 12), stride_y = std::max(1, rows_ / 12);
  int best_x = 0, best_y = 0;
  double best = -2.0;
  const auto look = [&](int i, int j) {
    const double cosine = node(i, j).dot(direction);
    if (!(cosine > best)) return;
    best = cosine;
    best_x = i;
    best_y = j;
  };
  for (int j = 0; j < rows_; j += stride_y)
    for (int i = 0; i < columns_; i += stride_x) look(i, j);
  for (int x = -1, y = -1; x != best_x || y != best_y;) {
    x = best_x;
    y = best_y;
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, rows_ - 1); ++j)
      for (int i = std::max(x - 1, 0); i <= std::min(x + 1, columns_ - 1); ++i) look(i, j);
  }
  return {best_x, best_y};
}

// Gauss and Newton with differences for slopes; the miss is of directions, so that it is good to their rounding
// whatever the slopes are good to.
std::optional<Vector2d> RayTable::place_from_point(const Vector3d& point) const {
  const Vector3d direction = point.normalized();
  if (!direction.allFinite()) return std::nullopt;
  Vector2d at = nearest(direction);
  Vector3d miss = direction - joined(at).normalized();
  constexpr double kStep = 1e-5;
  constexpr int kMostTurns = 60;
  for (int turn = 0; turn < kMostTurns && miss.norm() > 1e-16; ++turn) {
    Eigen::Matrix<double, 3, 2> slopes;
    for (int k = 0; k < 2; ++k) {
      const Vector2d shift = kStep * Vector2d::Unit(k);
      slopes.col(k) =
          (joined(at + shift).normalized() - joined(at - shift).normalized()) / (2.0 * kStep);
    }
    const Vector2d step = (slopes.transpose() * slopes).ldlt().solve(slopes.transpose() * miss);
    double share = 1.0;
    for (; share > 1e-6; share *= 0.5) {
      const Vector2d next = at + share * step;
      if (!holds(next)) continue;
      const Vector3d next_miss = direction - joined(next).normalized();
      if (!(next_miss.norm() < miss.norm())) continue;
      at = next;
      miss = next_miss;
      break;
    }
    if (!(share > 1e-6)) break;
  }
  constexpr double kMost = 1e-13;
  if (!(miss.norm() < kMost)) return std::nullopt;
  return at;
}

}  // namespace terracast::validate
