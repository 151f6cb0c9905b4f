#pragma once

#include <cstdint>
#include <cstring>

#include "core/packet_code.h"
#include "world/box_packet.h"

namespace terracast::world {

/// Vectors of GCC's: for use within a function only, since what passes them depends on the processor.
template <int kLanes>
struct LaneVectors {
  using Floats __attribute__((vector_size(4 * kLanes))) = float;
  using Integers __attribute__((vector_size(4 * kLanes))) = std::int32_t;
  using Doubles __attribute__((vector_size(8 * kLanes))) = double;
  using Bytes __attribute__((vector_size(kLanes))) = std::uint8_t;
};

/// The lowest byte of each lane.
template <int kLanes>
TERRACAST_PACKET_INLINE void bytes_of(const typename LaneVectors<kLanes>::Integers& lanes,
                                      LaneBytes<kLanes>& bytes) {
  const auto packed = __builtin_convertvector(lanes, typename LaneVectors<kLanes>::Bytes);
  std::memcpy(bytes.words.data(), &packed, sizeof packed);
}

}  // namespace terracast::world
