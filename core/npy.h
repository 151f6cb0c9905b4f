#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/image.h"

namespace terracast::core {

/// NumPy's array file, version 1.0: little-endian, C order.
/// values   as many as the product of `shape`
std::vector<std::byte> npy_bytes(std::span<const float> values, const std::vector<int>& shape);
std::vector<std::byte> npy_bytes(std::span<const double> values, const std::vector<int>& shape);
std::vector<std::byte> npy_bytes(std::span<const std::int32_t> values,
                                 const std::vector<int>& shape);
std::vector<std::byte> npy_bytes(std::span<const std::uint32_t> values,
                                 const std::vector<int>& shape);
/// Stored as bool; a value other than 0 is true.
std::vector<std::byte> npy_bool_bytes(std::span<const std::uint8_t> values,
                                      const std::vector<int>& shape);

/// An image, shape (height, width) of one channel, (height, width, channels) of more.
std::vector<std::byte> npy_bytes(const ImageF& image);
std::vector<std::byte> npy_bytes(const Image8& image);
std::vector<std::byte> npy_bytes(const ImageU32& image);

/// A column of a structured array.
struct NpyField {
  std::string name;       ///< without quotes and backslashes
  std::string_view type;  ///< "<f8", "<f4", "<u4", "<u2" or "|u1"
};

/// A structured array, whose fields `numpy.load(file)["name"]` gives.
/// rows   packed, without padding
std::vector<std::byte> npy_table_bytes(std::span<const NpyField> fields, std::size_t num_rows,
                                       std::span<const std::byte> rows);

}  // namespace terracast::core
