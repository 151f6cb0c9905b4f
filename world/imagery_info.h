#pragma once

#include <Eigen/Core>
#include <compare>
#include <cstdint>
#include <string>
#include <vector>

#include "core/image.h"

namespace terracast::world {

/// Pixels a side of a tile of imagery.
inline constexpr int kImageryTile_px = 512;

/// A tile of the world's x-y plane whose pixels have sides of 2^level m; x and y count tiles from the
/// world's origin east and north.
struct ImageryTileId {
  int level = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;

  double pixel_m() const;
  double side_m() const { return kImageryTile_px * pixel_m(); }
  Eigen::Vector2d corner_world() const { return side_m() * Eigen::Vector2d(x, y); }
  auto operator<=>(const ImageryTileId&) const = default;
};

struct ImageryTileInfo {
  ImageryTileId id;
  std::vector<int> sources;  ///< of ImageryInfo::sources, those that show in it; ascending
  std::uint64_t num_bytes = 0;
  std::string content_hash;
  bool operator==(const ImageryTileInfo&) const = default;
};

/// Pictures of the ground, all of one pixel size, with coarser levels down to a few tiles for the whole
/// world. A pixel is what the ground between its sides reflects: sRGB of the albedo, with alpha where not
/// all of it is known; its mean in linear light is that of the four pixels of the next finer level.
struct ImageryInfo {
  int layer = 0;  ///< row of WorldManifest::layers
  int finest_level = 0;
  int coarsest_level = 0;
  std::vector<std::string> sources;    ///< files without folders
  std::vector<ImageryTileInfo> tiles;  ///< sorted by id; where nothing is known there is none
};

}  // namespace terracast::world
