#pragma once

#include "core/log.h"
#include "job/job.h"
#include "render/render_stage.h"
#include "world/tile_store.h"

namespace terracast::job {

/// Adds the config's traffic to what moves through one of the job's sequences, if it has any.
/// store    the job's world, tiled
/// throws   Input: a world without ways; as TileStore::load_ways() and load()
void add_traffic(const Job& job, const world::TileStore& store, const core::Log& log,
                 render::SequencePlan& plan);

}  // namespace terracast::job
