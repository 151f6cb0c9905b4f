#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/image.h"

namespace terracast::core {

/// PNG of 1 (grey), 2, 3 (RGB) or 4 (RGBA) channels, no colour profile, no gamma, no time stamp.
/// 16-bit values are written big-endian as the format wants. Same input, same bytes.
/// level   1 (fast) to 12 (small), libdeflate's scale
/// cost    about 21 ns a pixel of 8-bit RGB at level 1
std::vector<std::byte> encode_png(const Image8& image, int level = 1);
std::vector<std::byte> encode_png(const Image16& image, int level = 1);

/// Decodes a PNG (by libpng) with its own channels and depth.
/// throws Input: not a PNG, damaged, or more than max_pixels
std::variant<Image8, Image16> decode_png(std::span<const std::byte> bytes, const std::string& name,
                                         std::size_t max_pixels = std::size_t{1} << 28);

/// A channel of an EXR part. FLOAT, HALF (given as float, rounded) and UINT.
struct ExrChannel {
  enum class Type { Float, Half, Uint };
  std::string name;
  Type type = Type::Float;
  std::span<const float> values_float = {};         ///< width*height values, for Float and Half
  std::span<const std::uint32_t> values_uint = {};  ///< width*height values, for Uint
};
struct ExrPart {
  std::string name;
  int width = 0;
  int height = 0;
  std::vector<ExrChannel> channels =
      {};  ///< any order; written in alphabetical order, as the format wants
  enum class Compression { None, Rle, Zips } compression = Compression::Rle;
  std::map<std::string, std::string> attributes = {};  ///< text attributes
};
/// An OpenEXR file (single part when one is given, else multi-part). Same input, same bytes.
std::vector<std::byte> encode_exr(const std::vector<ExrPart>& parts);

/// A decoded EXR part; each channel as the type it is stored in.
struct ExrImage {
  std::string name;
  int width = 0;
  int height = 0;
  std::map<std::string, ImageF> float_channels;   ///< FLOAT and HALF
  std::map<std::string, ImageU32> uint_channels;  ///< UINT
  std::map<std::string, std::string> attributes;
};
/// throws Input: not an EXR, damaged, or more than max_pixels
std::vector<ExrImage> decode_exr(std::span<const std::byte> bytes, const std::string& name,
                                 std::size_t max_pixels = std::size_t{1} << 28);

}  // namespace terracast::core
