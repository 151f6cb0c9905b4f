#pragma once

#include <bit>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
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
  void put_bytes(std::span<const std::uint8_t> bytes) {
    put_count(bytes.size());
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void put_text(std::string_view text) {
    put_bytes({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  void clear() { bytes_.clear(); }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Reads them; nothing beyond the end.
class ByteReader {
 public:
  /// file      for messages; must outlive the reader
  /// way_out   what is to be done about damage; a literal
  ByteReader(std::span<const std::uint8_t> bytes, const std::string& file,
             const char* way_out = "tile the world again")
      : bytes_(bytes), file_(file), way_out_(way_out) {}

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
  std::span<const std::uint8_t> get_bytes() {
    const std::size_t count = get_count(1);
    const std::span<const std::uint8_t> bytes = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return bytes;
  }
  std::string get_text() {
    const std::span<const std::uint8_t> bytes = get_bytes();
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  bool is_at_end() const { return bytes_.empty(); }
  [[noreturn]] void refuse(const char* why) const {
    core::fail(core::ErrorKind::Input, "{}: damaged: {}; {}", file_, why, way_out_);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  const std::string& file_;
  const char* way_out_;
};

}  // namespace terracast::world
