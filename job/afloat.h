#pragma once

#include <span>

#include "render/moving_bodies.h"
#include "tiler/surface.h"

namespace terracast::job {

/// Whether what rides water has any near, at every frame, for whoever wants to know before the world is tiled.
/// Where a shore is only tiles say, so what is on land at 160 m from water at most is left to
/// render::check_rides().
/// surface   with the world's layers
/// cost      one sample of the surface for each thing and frame on water, 97 on land
/// throws    Input: on land and far from water; says what, when and where
void check_afloat(std::span<const render::MovingThing> things, const tiler::WorldSurface& surface);

}  // namespace terracast::job
