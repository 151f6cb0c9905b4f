#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

namespace terracast::exporters {

/// A message as CDR (XCDR1, little-endian), as ROS 2 sends it: four bytes that say so, then each number at a multiple of
/// its size, counted after those four.
class CdrWriter {
 public:
  CdrWriter() : bytes_{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}} {}

  template <class Number>
  requires std::is_arithmetic_v<Number> CdrWriter& put(Number number) {
    align(sizeof(Number));
    const auto* at = reinterpret_cast<const std::byte*>(&number);
    bytes_.insert(bytes_.end(), at, at + sizeof(Number));
    return *this;
  }
  /// An array whose length the type fixes.
  CdrWriter& array(std::span<const double> numbers);
  CdrWriter& sequence(std::span<const double> numbers);
  CdrWriter& sequence(std::span<const std::byte> bytes);
  CdrWriter& text(std::string_view words);

  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  void align(std::size_t size);

  std::vector<std::byte> bytes_;
};

}  // namespace terracast::exporters
