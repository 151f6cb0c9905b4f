#pragma once

#include <filesystem>

#include "export/world/tile_model.h"
#include "export/world/world_format.h"

namespace terracast::world_export {

/// More make files that other programs choke on.
inline constexpr std::size_t kMostTriangles = 40'000'000;

/// Writes a model whose frame is east, north, up: as glTF 2 (binary, y up, x east, z south, as glTF
/// wants it) or as Wavefront OBJ with its materials beside it (z up). Atomically.
/// format   glb2 or obj
/// throws   Io: cannot be written; Input: more than kMostTriangles
void write_model(const WorldModel& model, const std::filesystem::path& file, const char* format);

/// Writes a region as one model about its centre.
void write_region_model(const WorldExportInputs& inputs, const char* format);

}  // namespace terracast::world_export
