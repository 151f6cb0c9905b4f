#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "tests/support/mesh_checks.h"
#include "world/shape.h"
#include "world/tile_id.h"

/// What shapes of buildings are like.
namespace terracast::test {

inline int steps(double value_m) {
  return static_cast<int>(std::lround(value_m / world::kHeightStep_m));
}

inline MeshFacts sound_facts(const world::Shape& shape, const std::string& what) {
  const MeshFacts facts = mesh_facts(shape);
  EXPECT_EQ(facts.problem, "") << what;
  EXPECT_FALSE(facts.meets_itself) << what;
  return facts;
}

/// Of what is turned upward, seen from above, m2.
inline double area_from_above_m2(const world::Shape& shape) {
  double sum = 0.0;
  for (const auto& triangle : shape.triangles) {
    std::array<Eigen::Vector2d, 3> at;
    for (std::size_t k = 0; k < 3; ++k)
      at[k] =
          shape.vertices_steps[triangle.corners[k]].head<2>().cast<double>() * world::kHeightStep_m;
    const Eigen::Vector2d u = at[1] - at[0];
    const Eigen::Vector2d v = at[2] - at[0];
    sum += std::max(0.5 * (u.x() * v.y() - u.y() * v.x()), 0.0);
  }
  return sum;
}

/// The box about what a shape shows.
inline std::pair<Eigen::Vector3d, Eigen::Vector3d> box_of(const world::Shape& shape) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
  for (const Eigen::Vector3i& vertex : shape.vertices_steps) {
    low = low.cwiseMin(vertex.cast<double>() * world::kHeightStep_m);
    high = high.cwiseMax(vertex.cast<double>() * world::kHeightStep_m);
  }
  return {low, high};
}

}  // namespace terracast::test
