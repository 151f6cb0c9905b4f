#pragma once

#include "world/shape.h"

namespace terracast::tiler {

/// Whether a shape may be shown: closed and oriented by the places of its vertices, without
/// degenerate triangles, and nothing of it crosses anything else of it.
bool is_sound(const world::Shape& shape);

}  // namespace terracast::tiler
