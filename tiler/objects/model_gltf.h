#pragma once

#include <cstddef>
#include <span>

#include "tiler/objects/model_folder.h"
#include "tiler/objects/model_scene.h"

namespace terracast::tiler {

/// Reads glTF 2 (.gltf, .glb): the nodes of its scene with their meshes; base colours as glTF has them, the linear factor x
/// the picture (sRGB) x the linear COLOR_0; the set of coordinates that a texture names, and KHR_texture_transform; skins
/// as their joints stand, and targets by their shares in the file, as it shows itself before any animation; sparse
/// accessors; copies of EXT_mesh_gpu_instancing. Points and lines are counted.
/// throws   Input: as check_gltf(), and numbers that do not fit together
ModelScene read_gltf(std::span<const std::byte> bytes, ModelFolder& folder);

}  // namespace terracast::tiler
