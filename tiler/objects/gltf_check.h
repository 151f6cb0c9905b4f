#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/json.h"
#include "tiler/objects/model_folder.h"

namespace terracast::tiler {

/// A .gltf or .glb taken apart.
struct GltfFile {
  core::Json root;
  std::span<const std::byte> binary;  ///< of a .glb; lies in its bytes
};

/// name     for messages
/// throws   Input: no JSON, glTF 1, parts that state more bytes than there are
GltfFile open_gltf(std::span<const std::byte> bytes, const std::string& name);

/// Looks through a glTF file's description before it is read: its version, the extensions that it requires, that its files
/// lie in its folder, that accessors lie in their views and these in their buffers, that its nodes are a tree, and that
/// skins have their joints.
/// throws   Input: saying what does not hold
void check_gltf(const GltfFile& file, const ModelFolder& folder);

/// A member that is a list; an empty one where there is none.
/// throws   Input: it is something else
const core::Json& gltf_list(const core::Json& object, const char* member);

}  // namespace terracast::tiler
