#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace terracast::tiler {

/// Holds what a PLY states of itself against its bytes: assimp makes room for the lists of a billion values that a
/// damaged or hostile file of some hundred bytes may state.
/// name     begins the errors
/// throws   Input: no PLY, or one that states more than it holds
void check_ply(std::span<const std::byte> bytes, const std::string& name);

}  // namespace terracast::tiler
