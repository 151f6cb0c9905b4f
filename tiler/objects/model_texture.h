#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "core/image.h"

namespace terracast::tiler {

/// Decodes a PNG or JPEG to sRGB of three or four channels.
/// throws   Input: neither, damaged, or more pixels than a texture may have (world/texture.h), which is known before
///          any pixel is decoded
core::Image8 decode_texture(std::span<const std::byte> bytes, const std::string& name);

}  // namespace terracast::tiler
