#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "core/context.h"
#include "tiler/surface.h"
#include "world/lod.h"
#include "world/tile_store.h"

namespace terracast::tiler {

/// What the tiler shall make beside the base level: fine tiles where sequences look.
struct TilePlan {
  world::DetailOptions detail;
  std::vector<std::vector<world::Viewpoint>> sequences;  ///< all camera places of each sequence
};

/// Tiles a world: coarse levels everywhere (the apron out to the horizon of the highest viewpoint
/// included), finer ones where a viewpoint wants them, closed under balance. Parallel; resumable:
/// tiles that are there and whole are kept, the manifest is written last. A later run with other
/// sequences adds tiles and keeps those that are there.
/// throws   Config: `folder` holds a world of other inputs (says which hash); Input, Io
world::TileStore run_tile_stage(const WorldSurface& surface, const TilePlan& plan,
                                const std::filesystem::path& folder, const core::Context& context);

}  // namespace terracast::tiler
