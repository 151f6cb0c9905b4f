#pragma once

#include <span>
#include <vector>

#include "core/semantic_class.h"
#include "scene/ground/ground.h"
#include "world/ray_query.h"

namespace terracast::sensors::lidar {

/// The classes of what rays met, as pixels of cameras have them; Sky of those that met nothing. Threads: safe.
/// surfaces   as they are with world::SurfaceNeed::Look
void classify(const scene::Ground& ground, std::span<const world::WorldRay> rays,
              std::span<const world::SurfaceHit> hits,
              std::span<const world::SurfaceSample> surfaces,
              std::vector<core::SemanticClass>& classes);

}  // namespace terracast::sensors::lidar
