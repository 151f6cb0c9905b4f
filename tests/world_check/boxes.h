#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "world/tile_objects.h"

/// Boxes as buildings.
namespace terracast::world_check {

inline constexpr int kSteps = 1024;  ///< a metre

/// A box from `low` to `high`, in metres, closed and outward.
inline world::Shape box(const Eigen::Vector3i& low, const Eigen::Vector3i& high) {
  world::Shape shape;
  for (int k = 0; k < 8; ++k)
    shape.vertices_steps.push_back(kSteps * Eigen::Vector3i((k & 1) != 0 ? high.x() : low.x(),
                                                            (k & 2) != 0 ? high.y() : low.y(),
                                                            (k & 4) != 0 ? high.z() : low.z()));
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    shape.triangles.push_back({.corners = {a, b, c}, .finish = 0});
    shape.triangles.push_back({.corners = {a, c, d}, .finish = 0});
  };
  add(0, 2, 3, 1);
  add(4, 5, 7, 6);
  add(0, 1, 5, 4);
  add(1, 3, 7, 5);
  add(3, 2, 6, 7);
  add(2, 0, 4, 6);
  shape.finishes.push_back({.material = world::Material::Plaster});
  return shape;
}

}  // namespace terracast::world_check
