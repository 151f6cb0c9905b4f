#pragma once

#include <cstdint>
#include <cstring>

#include "core/packet_code.h"
#include "world/box_packet.h"

/// Functions over the lanes of a packet, compiled for AVX-512 too. They do the same IEEE operations with each.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(TERRACAST_BASELINE_PACKETS) && !defined(__SANITIZE_THREAD__)
#define TERRACAST_WIDE_CODE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define TERRACAST_WIDE_CODE
#endif

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
