#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/image.h"

namespace terracast::tiler {

/// Decodes a PNG or JPEG to sRGB of three or four channels.
/// bytes_left   that textures may still take in memory, coarser levels included; less what this one takes
/// throws       Input: neither, damaged, more pixels than a texture may have (world/texture.h) or more than are left, both
///              of which are known before any pixel is decoded
core::Image8 decode_texture(std::span<const std::byte> bytes, const std::string& name,
                            std::uint64_t& bytes_left);

}  // namespace terracast::tiler
