#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/context.h"
#include "export/world/region.h"
#include "world/tile_store.h"

namespace terracast::world_export {

/// What is asked of a format.
struct WorldExportInputs {
  const world::TileStore& store;
  Region region;            ///< of a format's writer: within the world's square
  double finest_spacing_m;  ///< of the terrain, a tile's own
  /// Side of a pixel of the pictures of the ground, on the finest tiles; 0: no pictures, nor textures of models; nothing:
  /// the format's choice. Rasters have their pixels' own.
  std::optional<double> texel_m = std::nullopt;
  std::filesystem::path destination;  ///< a file, or a folder where has_folder
  const core::Context& context;
};

/// A format in which a part of a world is written. Same world and region, same bytes.
struct WorldFormatInfo {
  std::string_view name;
  std::string_view summary;
  std::string_view suffix;  ///< of the destination; "" for a folder
  /// throws   Input: the region holds nothing that the format writes, or too much for it; Io; Interrupted
  void (*write)(const WorldExportInputs& inputs);
};

/// The table of formats: 3dtiles, geotiff, gltf, obj, vdb.
std::span<const WorldFormatInfo> world_formats();

/// Writes what of a region lies in the world's square (clipped_to_square()), and says so where that is not all of it.
/// throws   Input: the region lies outside the world's square; as WorldFormatInfo::write
void export_region(const WorldFormatInfo& format, WorldExportInputs inputs);

}  // namespace terracast::world_export
