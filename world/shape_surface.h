#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "world/shape.h"
#include "world/triangle_crossing.h"

/// What a shape's triangle is like where a ray crosses it.
namespace terracast::world {

/// Across the triangle, twice its area long, in steps of kHeightStep_m squared.
Eigen::Vector3d normal_of(const TriangleCorners& corners);

/// Shape::uv at a crossing; without such, 0.
/// ray       in the frame of the corners
/// throws    Internal: it does not cross the triangle
Eigen::Vector2f uv_at(const Shape& shape, std::uint32_t triangle, const ShearedRay& ray,
                      const TriangleCorners& corners);

/// Lengths of uv in a metre of a shape's triangle: the root of what areas grow by. 0 but of Textured.
/// normal_steps2   as normal_of()
float uv_per_m(const Shape& shape, std::uint32_t triangle, const Eigen::Vector3d& normal_steps2);

}  // namespace terracast::world
