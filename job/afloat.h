#pragma once

#include <span>

#include "render/checked_plan.h"
#include "scene/moving/moving_bodies.h"
#include "tiler/surface.h"

namespace terracast::job {

/// Whether what rides water has any near, at every frame, for whoever wants to know before the world is tiled.
/// Where a shore is only tiles say, so what is on land at 160 m from water at most is left to
/// render::check_rides(). Water less than 5 m wide may be missed.
/// surface   with the world's layers
/// cost      a sample of the surface where there is water; on land up to 3409, once for about each 160 m of a way
/// throws    Input: on land and far from water; says what, when and where
void check_afloat(std::span<const scene::MovingThing> things, const tiler::WorldSurface& surface);

}  // namespace terracast::job
