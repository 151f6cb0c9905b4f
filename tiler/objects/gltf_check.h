#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace terracast::tiler {

/// Looks through a glTF file's description before it is read: its version, the extensions that it requires,
/// that its files lie in its folder, that accessors lie in their views and these in their buffers, and that its
/// nodes are a tree.
/// bytes    of the .gltf or .glb
/// name     for messages
/// throws   Input: saying what does not hold
void check_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder,
                const std::string& name);

/// A path that a model's file names, in its folder.
/// throws   Input: absolute, another scheme than data:, or leading out of the folder
std::filesystem::path path_in_folder(const std::string& uri, const std::filesystem::path& folder,
                                     const std::string& name);

}  // namespace terracast::tiler
