#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
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

}  // namespace terracast::core
