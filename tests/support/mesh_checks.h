#pragma once

#include <string>

#include "world/shape.h"

namespace terracast::test {

/// What CGAL says of a shape's triangles, corners of one place taken for one.
struct MeshFacts {
  std::string
      problem;  ///< empty: closed, 2-manifold, oriented outward, no triangle without an area
  bool meets_itself = false;
  double volume_m3 = 0.0;
};

MeshFacts mesh_facts(const world::Shape& shape);

}  // namespace terracast::test
