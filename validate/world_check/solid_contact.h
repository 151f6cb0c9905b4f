#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "world/shape.h"

namespace terracast::world_check {

/// A closed shape at its place.
struct PlacedShape {
  Eigen::Vector3i origin_steps = Eigen::Vector3i::Zero();
  const world::Shape* shape = nullptr;

  /// m
  Eigen::Vector3d vertex_world(const Eigen::Vector3i& vertex_steps) const;
};

/// Whether an upright line from a point meets an odd number of a shape's triangles above it.
bool contains(const PlacedShape& placed, const Eigen::Vector3d& point_world);
/// Whether a point lies in a shape, or no farther than that from its surface.
bool meets(const PlacedShape& placed, const Eigen::Vector3d& point_world, double within_m);

/// What a body stands with on others: places of its bottom, which are its faces that look down and lie no more than that
/// above its lowest point.
struct Bottom {
  /// Corners and places between them, a metre apart along edges and over faces, so much farther
  /// on wide bottoms that they are kMostPlaces at most; none twice.
  std::vector<Eigen::Vector3d> places_world;
  std::optional<Eigen::Vector3d> middle_world;  ///< by area; of a body that has no such face none
  static constexpr std::size_t kMostPlaces = 1000;
};
Bottom bottom_of(const PlacedShape& placed, double above_lowest_m);

/// Whether a place lies within the hull of others, no corner or edge of it: each line through it has some on either side.
bool is_between(const Eigen::Vector2d& place, const std::vector<Eigen::Vector2d>& others);

}  // namespace terracast::world_check
