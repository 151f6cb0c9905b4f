#pragma once

#include "core/log.h"
#include "job/job.h"
#include "render/render_stage.h"
#include "world/tile_store.h"

namespace terracast::job {

/// Adds the config's traffic to what moves through one of the job's sequences, if it has any. It gives room to what moves near
/// the ground: things of `[[moving]]` and the bodies of all trajectories that are shown, the sequence's own among them,
/// which are the same in every sequence; and in its own sequence alone to a body that is not shown. So sequences see the
/// same traffic whose trajectories are all shown; one that is not misses whom its own body, taken for a car, would meet,
/// and, if it lasts longer than all that are shown, has traffic of its own.
/// store    the job's world, tiled
/// throws   Input: a world without ways; as TileStore::load_ways() and load()
void add_traffic(const Job& job, const world::TileStore& store, const core::Log& log,
                 render::SequencePlan& plan);

}  // namespace terracast::job
