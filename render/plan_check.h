#pragma once

#include "render/render_stage.h"
#include "world/ray_query.h"
#include "world/tile_store.h"

/// What rendering refuses of a sequence, for whoever wants to know before others are rendered.
namespace terracast::render {

/// Whether a sequence's rate of frames leaves its cameras the time that they take.
/// throws Config: an image that takes longer than the time to the next, or an exposure control that looks further
/// back than is looked
void check_exposures(const SequencePlan& plan);

/// Whether what rides ground or water finds it, at every frame.
/// cost     some rays for each such thing and frame
/// throws   as MovingBodies
void check_rides(const SequencePlan& plan, const world::TileStore& store,
                 const world::RayQueryOptions& tracing);

}  // namespace terracast::render
