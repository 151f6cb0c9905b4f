#pragma once

#include <cstdint>
#include <string>

#include "world/shape.h"

namespace terracast::world_check {

/// What is wrong with the triangles of a shape, corners of one place taken for one.
struct ShapeFaults {
  std::int64_t num_degenerate = 0;  ///< triangles without an area
  std::int64_t num_coincident = 0;  ///< triangles over the very corners of another one
  std::int64_t num_open = 0;        ///< edges that an odd number of triangles has
  std::int64_t num_turned = 0;      ///< edges along which neighbours do not face the same way
  std::int64_t num_inside_out = 0;  ///< closed parts whose volume is not above 0
  std::int64_t num_bodies = 0;      ///< closed parts
  std::int64_t num_meeting_themselves = 0;  ///< closed parts that meet themselves
};

/// Materials whose triangles are sheets by their nature, and need not be closed: leaves, needles and
/// blades.
bool is_sheet(world::Material material);

/// Exact: corners are whole steps. Sheets count for triangles without an area alone.
/// is_model   a user's, of which nothing counts as a sheet; bodies are not looked for (num_bodies 0)
ShapeFaults find_shape_faults(const world::Shape& shape, bool is_model = false);

}  // namespace terracast::world_check
