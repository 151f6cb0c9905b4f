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

/// A map of the world's square, north up: hypsometric tints under a hillshade, sea, roads and buildings,
/// hatches over what was filled and not measured, contour of the square, the paths with start marks, a scale bar, north arrow and legend.
/// size_px   of the longer side
/// throws    Config: size_px out of 64 to 16384; Input, Io: tiles that cannot be loaded
core::Image8 render_preview(const world::TileStore& store, const std::vector<PreviewPath>& paths,
                            int size_px = 1024);

/// Nothing but the relief of a part of the world frame's x-y plane: hypsometric tints under a
/// hillshade, sea.
/// world_from_pixel   x right, y down, from the corner of the top-left pixel; pixels are square
/// throws    Config: a side out of 1 to 16384 px, or a pixel without extent; Input, Io: tiles that
///           cannot be loaded
core::Image8 render_relief(const world::TileStore& store, const Eigen::Affine2d& world_from_pixel,
                           int width_px, int height_px);

/// Extents, levels with their tiles and sizes, datums, sources, voids: what `terracast world info`
/// prints.
std::string describe_world(const world::TileStore& store);

/// What the files of its sources say, and what became of it: a table for each source and layer, for `world info --ledger`.
std::string ledger_text(const world::TileStore& store);

}  // namespace terracast::tiler
