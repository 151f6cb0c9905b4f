#pragma once

#include <cstddef>
#include <span>

#include "core/ledger.h"
#include "tiler/objects/model_folder.h"
#include "tiler/objects/model_scene.h"

namespace terracast::tiler {

/// Reads a PLY of any of its three forms: places of vertices, colours of vertices or faces, coordinates of textures of
/// vertices or faces with the pictures that its comments name (TextureFile), faces and strips of triangles. Colours are
/// what a screen shows (sRGB), as Blender, MeshLab and three.js have them; whole numbers are of their type's range, others
/// of 0 to 1. What it states of itself is compared with its bytes first.
/// throws   Input: no PLY, one that states more than it holds, or numbers that do not fit together
ModelScene read_ply(std::span<const std::byte> bytes, ModelFolder& folder);

/// Elements, properties and lines of the head that it knows.
std::span<const core::KnownName> ply_names();

}  // namespace terracast::tiler
