#pragma once

#include <bit>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/error.h"

namespace terracast::world {

static_assert(std::endian::native == std::endian::little, "world files are little-endian");

/// Writes numbers one after the other, little-endian, without padding.
class ByteWriter {
 public:
  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) {
    const auto* first = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), first, first + sizeof value);
  }
  void put_count(std::size_t count) {
    TERRACAST_CHECK(count <= 0xffffffffU, "{} things in a file", count);
    put(static_cast<std::uint32_t>(count));
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Reads them; nothing beyond the end.
class ByteReader {
 public:
  /// file   for messages; must outlive the reader
  ByteReader(std::span<const std::uint8_t> bytes, const std::string& file)
      : bytes_(bytes), file_(file) {}

  template <class T>
  requires std::is_arithmetic_v<T> T get() {
    if (bytes_.size() < sizeof(T)) refuse("it ends too early");
    T value;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  /// A number of things that take at least so many bytes each: no more than are there.
  std::size_t get_count(std::size_t least_bytes_each) {
    const auto count = std::size_t{get<std::uint32_t>()};
    if (count > bytes_.size() / least_bytes_each) refuse("it counts more than it holds");
    return count;
  }
  bool is_at_end() const { return bytes_.empty(); }
  [[noreturn]] void refuse(const char* why) const {
    core::fail(core::ErrorKind::Input, "{}: damaged: {}; tile the world again", file_, why);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  const std::string& file_;
};

}  // namespace terracast::world
