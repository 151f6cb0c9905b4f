#include "validate/world_check/solid_contact.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "world/tile.h"

namespace terracast::world_check {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

Corners corners_of(const PlacedShape& placed, const world::Shape::Triangle& triangle) {
  Corners corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] = placed.vertex_world(placed.shape->vertices_steps[triangle.corners[k]]);
  return corners;
}

/// Nearest to a point on the stretch between two others.
double distance_to_edge(const Vector3d& point, const Vector3d& a, const Vector3d& b) {
  const Vector3d along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((point - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (point - a - t * along).norm();
}

double distance_to(const Corners& corners, const Vector3d& point) {
  const auto& [a, b, c] = corners;
  double least = std::min({distance_to_edge(point, a, b), distance_to_edge(point, b, c),
                           distance_to_edge(point, c, a)});
  const Vector3d normal = (b - a).cross(c - a).normalized();
  if (!normal.allFinite() || normal.isZero()) return least;
  const double height = normal.dot(point - a);
  const Vector3d foot = point - height * normal;
  const auto is_left_of = [&](const Vector3d& from, const Vector3d& to) {
    return normal.dot((to - from).cross(foot - from)) >= 0.0;
  };
  if (is_left_of(a, b) && is_left_of(b, c) && is_left_of(c, a))
    least = std::min(least, std::abs(height));
  return least;
}

}  // namespace

Vector3d PlacedShape::vertex_world(const Eigen::Vector3i& vertex_steps) const {
  return (origin_steps + vertex_steps).cast<double>() * world::kHeightStep_m;
}

bool contains(const PlacedShape& placed, const Vector3d& point_world) {
  const Vector2d place = point_world.head<2>();
  int num_above = 0;
  for (const world::Shape::Triangle& triangle : placed.shape->triangles) {
    const Corners corners = corners_of(placed, triangle);
    std::array<double, 3> weights;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2d b = corners[(k + 1) % 3].head<2>() - place;
      const Vector2d c = corners[(k + 2) % 3].head<2>() - place;
      weights[k] = b.x() * c.y() - b.y() * c.x();
    }
    const bool is_left = weights[0] > 0 && weights[1] > 0 && weights[2] > 0;
    const bool is_right = weights[0] < 0 && weights[1] < 0 && weights[2] < 0;
    if (!is_left && !is_right) continue;
    const double z =
        (weights[0] * corners[0].z() + weights[1] * corners[1].z() + weights[2] * corners[2].z()) /
        (weights[0] + weights[1] + weights[2]);
    if (z > point_world.z()) ++num_above;
  }
  return num_above % 2 != 0;
}

bool meets(const PlacedShape& placed, const Vector3d& point_world, double within_m) {
  // A line through a corner or an edge above meets no triangle: one a little beside it does.
  const Vector3d beside(0.137 * world::kHeightStep_m, 0.071 * world::kHeightStep_m, 0.0);
  if (contains(placed, point_world + beside)) return true;
  return std::any_of(placed.shape->triangles.begin(), placed.shape->triangles.end(),
                     [&](const world::Shape::Triangle& triangle) {
                       return distance_to(corners_of(placed, triangle), point_world) <= within_m;
                     });
}

Bottom bottom_of(const PlacedShape& placed, double above_lowest_m) {
  double lowest_z = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3i& vertex : placed.shape->vertices_steps)
    lowest_z = std::min(lowest_z, placed.vertex_world(vertex).z());
  Bottom bottom;
  double area = 0.0;
  for (const world::Shape::Triangle& triangle : placed.shape->triangles) {
    const Corners corners = corners_of(placed, triangle);
    const auto& [a, b, c] = corners;
    const double seen_from_below = -0.5 * (b - a).cross(c - a).z();
    if (std::any_of(
            corners.begin(), corners.end(),
            [&](const Vector3d& corner) { return corner.z() > lowest_z + above_lowest_m; }) ||
        !(seen_from_below > 0.0))
      continue;
    area += seen_from_below;
    bottom.middle_world += seen_from_below / 3.0 * (a + b + c);
    constexpr double kApart_m = 1.0;
    constexpr int kMostParts = 32;
    const double longest_m = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int parts =
        static_cast<int>(std::clamp<double>(std::ceil(longest_m / kApart_m), 1.0, kMostParts));
    for (int i = 0; i <= parts; ++i)
      for (int j = 0; i + j <= parts; ++j)
        bottom.places_world.emplace_back(a + (b - a) * i / parts + (c - a) * j / parts);
  }
  if (area > 0.0) bottom.middle_world /= area;
  return bottom;
}

bool is_between(const Vector2d& place, const std::vector<Vector2d>& others) {
  if (others.size() < 3) return false;
  std::vector<double> bearings_rad;
  for (const Vector2d& other : others)
    bearings_rad.push_back(std::atan2((other - place).y(), (other - place).x()));
  std::sort(bearings_rad.begin(), bearings_rad.end());
  double widest_rad = bearings_rad.front() + 2.0 * std::numbers::pi - bearings_rad.back();
  for (std::size_t i = 1; i < bearings_rad.size(); ++i)
    widest_rad = std::max(widest_rad, bearings_rad[i] - bearings_rad[i - 1]);
  constexpr double kRounding_rad = 1e-9;
  return widest_rad < std::numbers::pi - kRounding_rad;
}

}  // namespace terracast::world_check
