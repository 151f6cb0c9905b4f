#pragma once

#include <Eigen/Core>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>

#include "core/random.h"

/// Places of ways, of which those that are near are one.
namespace terracast::tiler {

/// Points nearer than this are one.
inline constexpr double kSamePlace_m = 0.01;
/// Stations are no farther apart.
inline constexpr double kStation_m = 8.0;

struct PlaceKey {
  std::int64_t x;
  std::int64_t y;
  auto operator<=>(const PlaceKey&) const = default;
};
struct PlaceKeyHash {
  std::size_t operator()(const PlaceKey& key) const {
    return core::mix_bits(core::mix_bits(static_cast<std::uint64_t>(key.x)) ^
                          static_cast<std::uint64_t>(key.y));
  }
};
inline PlaceKey key_of(const Eigen::Vector2d& at) {
  return {std::llround(at.x() / kSamePlace_m), std::llround(at.y() / kSamePlace_m)};
}

}  // namespace terracast::tiler
