#pragma once

#include <cstddef>
#include <cstdint>

namespace terracast::core {

/// Things that move have instance ids from here up, in their order; nothing that stands in a world has one of
/// these. The last, 2^32 - 1, is none's.
inline constexpr std::uint32_t kFirstMovingId = 0xffff0000U;
inline constexpr std::size_t kMostMovingThings = 0xffff;

constexpr bool is_moving_id(std::uint32_t instance_id) { return instance_id >= kFirstMovingId; }

}  // namespace terracast::core
