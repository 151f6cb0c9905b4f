#include "world/shape_surface.h"

#include <cmath>

#include "core/error.h"
#include "world/tile.h"

namespace terracast::world {

Eigen::Vector3d normal_of(const TriangleCorners& corners) {
  const Eigen::Vector3d first = corners[0].cast<double>();
  return (corners[1].cast<double>() - first).cross(corners[2].cast<double>() - first);
}

Eigen::Vector2f uv_at(const Shape& shape, std::uint32_t triangle, const ShearedRay& ray,
                      const TriangleCorners& corners) {
  if (shape.uv.empty()) return Eigen::Vector2f::Zero();
  TriangleCrossing crossing;
  TERRACAST_CHECK(cross_triangle(ray, corners, crossing), "a meeting that is none");
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();
  for (std::size_t k = 0; k < 3; ++k)
    uv += crossing.weights[k] * shape.uv[shape.triangles[triangle].corners[k]].cast<double>();
  return uv.cast<float>();
}

float uv_per_m(const Shape& shape, std::uint32_t triangle, const Eigen::Vector3d& normal_steps2) {
  const Shape::Triangle& one = shape.triangles[triangle];
  if (shape.uv.empty() || shape.finishes[one.finish].material != Material::Textured) return 0.0f;
  const Eigen::Vector2f first = shape.uv[one.corners[0]];
  const Eigen::Vector2d along = (shape.uv[one.corners[1]] - first).cast<double>();
  const Eigen::Vector2d aside = (shape.uv[one.corners[2]] - first).cast<double>();
  const double area_uv = std::abs(along.x() * aside.y() - along.y() * aside.x());
  const double area_m2 = normal_steps2.norm() * kHeightStep_m * kHeightStep_m;
  return static_cast<float>(std::sqrt(area_uv / area_m2));
}

}  // namespace terracast::world
