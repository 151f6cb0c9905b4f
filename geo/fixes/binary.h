#pragma once

#include <bit>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <span>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/fixes/text.h"

/// Binary recordings.
namespace terracast::geo {

static_assert(std::endian::native == std::endian::little, "binary recordings are little-endian");

/// A little-endian number at any address.
/// offset   it lies whole within the bytes
template <class Number>
Number number_at(std::span<const std::byte> bytes, std::size_t offset) {
  TERRACAST_CHECK(offset <= bytes.size() && sizeof(Number) <= bytes.size() - offset,
                  "a number at {} of {} bytes", offset, bytes.size());
  Number number;
  std::memcpy(&number, bytes.data() + offset, sizeof(Number));
  return number;
}

/// throws   Io: no such file; Input: larger than what is read of a recording
inline std::vector<std::byte> bytes_of_recording(const std::filesystem::path& file) {
  refuse_if_too_large(file);
  return core::read_file(file);
}

}  // namespace terracast::geo
