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

bool is_before(const Vector3d& a, const Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

double seen_from_below_m2(const Corners& corners) {
  const auto& [a, b, c] = corners;
  return -0.5 * (b - a).cross(c - a).z();
}

/// Faces that look down, no more than that above the lowest point.
std::vector<Corners> faces_below(const PlacedShape& placed, double above_lowest_m) {
  double lowest_z = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3i& vertex : placed.shape->vertices_steps)
    lowest_z = std::min(lowest_z, placed.vertex_world(vertex).z());
  std::vector<Corners> faces;
  for (const world::Shape::Triangle& triangle : placed.shape->triangles) {
    const Corners corners = corners_of(placed, triangle);
    if (seen_from_below_m2(corners) > 0.0 &&
        std::all_of(corners.begin(), corners.end(), [&](const Vector3d& corner) {
          return corner.z() <= lowest_z + above_lowest_m;
        }))
      faces.push_back(corners);
  }
  return faces;
}

/// Places along the edges of a triangle, both ends of each, and in rows between them.
void strew(Corners corners, double apart_m, std::vector<Vector3d>& places) {
  const auto parts_of = [&](double length_m) {
    return static_cast<int>(std::max(std::ceil(length_m / apart_m), 1.0));
  };
  const auto length_of = [&](std::size_t k) { return (corners[(k + 1) % 3] - corners[k]).norm(); };
  std::size_t longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    // From the same end in both triangles that share it: they find the same places.
    Vector3d from = corners[k], to = corners[(k + 1) % 3];
    if (is_before(to, from)) std::swap(from, to);
    const int parts = parts_of(length_of(k));
    for (int i = 0; i < parts; ++i) places.emplace_back(from + (to - from) * i / parts);
    places.push_back(to);
    if (length_of(k) > length_of(longest)) longest = k;
  }
  std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(longest),
              corners.end());
  const auto& [a, b, c] = corners;
  const double longest_m = (b - a).norm();
  const int rows = parts_of((b - a).cross(c - a).norm() / longest_m);
  for (int row = 1; row < rows; ++row) {
    const Vector3d from = a + (c - a) * row / rows, to = b + (c - b) * row / rows;
    const int parts = parts_of(longest_m * (rows - row) / rows);
    for (int i = 1; i < parts; ++i) places.emplace_back(from + (to - from) * i / parts);
  }
}

/// Leaves each place once; of more than there may be, as thousands of corners are, every n-th.
void thin_out(std::vector<Vector3d>& places) {
  std::sort(places.begin(), places.end(), is_before);
  places.erase(std::unique(places.begin(), places.end()), places.end());
  const std::size_t step = (places.size() + Bottom::kMostPlaces - 1) / Bottom::kMostPlaces;
  if (step <= 1) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < places.size(); i += step) places[kept++] = places[i];
  places.resize(kept);
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
  const std::vector<Corners> faces = faces_below(placed, above_lowest_m);
  if (faces.empty()) return {};
  double area_m2 = 0.0, edges_m = 0.0;
  Vector3d moment = Vector3d::Zero();
  for (const Corners& face : faces) {
    const auto& [a, b, c] = face;
    const double seen_m2 = seen_from_below_m2(face);
    area_m2 += seen_m2;
    moment += seen_m2 / 3.0 * (a + b + c);
    edges_m += (b - a).norm() + (c - b).norm() + (a - c).norm();
  }
  // So far apart that edges_m / apart_m + area_m2 / apart_m^2 are as many as there may be.
  constexpr auto kMost = static_cast<double>(Bottom::kMostPlaces);
  const double apart_m =
      std::max(1.0, (edges_m + std::sqrt(edges_m * edges_m + 4.0 * kMost * area_m2)) / (2 * kMost));
  Bottom bottom;
  for (const Corners& face : faces) strew(face, apart_m, bottom.places_world);
  thin_out(bottom.places_world);
  bottom.middle_world = moment / area_m2;
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
