#pragma once

#include "world/shape.h"

namespace terracast::tiler {

/// A coarser shape: vertices that lie in one cube of a grid become the one of them nearest to their mean;
/// triangles that lose a corner, and repeated ones, are left out. No point moves farther than the cube's diagonal.
world::Shape clustered(const world::Shape& shape, double cell_m);

}  // namespace terracast::tiler
