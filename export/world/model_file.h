#pragma once

#include <filesystem>

#include "export/world/tile_model.h"
#include "export/world/world_format.h"

namespace terracast::world_export {

/// More pixels of pictures no file holds, nor more along a picture's side.
inline constexpr double kMostTexturePixels = 0x1p28;
inline constexpr int kMostTextureSide_px = 4096;

/// Pixels along a side of the picture of each tile's ground, a power of two; 0: there are none.
/// cut          the finest tile has pixels of the size asked for; others have as many of them
/// usual_px     where no size is asked for; fewer where a file would not hold so many
/// num_files    over which the pictures are spread
/// throws       Input: more than kMostTextureSide_px or kMostTexturePixels
int texture_side_px(const WorldExportInputs& inputs, const std::vector<world::CutTile>& cut,
                    int usual_px, std::size_t num_files);

/// Writes a model whose frame is east, north, up: as glTF 2 (binary, y up, x east, z south, as glTF
/// wants it) or as Wavefront OBJ with its materials and pictures beside it (z up). Each file atomically. It says where
/// it stands: glTF in its asset's extras, OBJ in comments at its head.
/// origin   of the model's frame
/// format   glb2 or obj
/// throws   Io: cannot be written; Input: no triangle
void write_model(const WorldModel& model, const geo::Geodetic& origin,
                 const std::filesystem::path& file, const char* format);

/// Writes a region as one model about its centre.
void write_region_model(const WorldExportInputs& inputs, const char* format);

}  // namespace terracast::world_export
