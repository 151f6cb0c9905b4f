#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "core/image.h"
#include "world/tile_store.h"

namespace terracast::tiler {

/// A path drawn on the map.
struct PreviewPath {
  std::string name;
  std::vector<Eigen::Vector3d> positions_world;
};

/// A map of the world's square, north up: hypsometric tints under a hillshade, sea, contour of the
/// square, the paths with start marks, a scale bar, north arrow and legend.
/// size_px   of the longer side
/// throws    Config: size_px out of 64 to 16384; Input, Io: tiles that cannot be loaded
core::Image8 render_preview(const world::TileStore& store, const std::vector<PreviewPath>& paths,
                            int size_px = 1024);

/// Nothing but the relief of a rectangle of the world frame's x-y plane, north up: hypsometric tints
/// under a hillshade, sea.
/// size_px   of the longer side
/// throws    Config: size_px out of 64 to 16384, or an empty area; Input, Io: tiles that cannot be
///           loaded
core::Image8 render_relief(const world::TileStore& store, const Eigen::AlignedBox2d& area_world,
                           int size_px);

/// Extents, levels with their tiles and sizes, datums, sources, voids: what `terracast world info`
/// prints.
std::string describe_world(const world::TileStore& store);

}  // namespace terracast::tiler
