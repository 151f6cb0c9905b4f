#pragma once

// Before a source of packet code: it is compiled for AVX2 alone, as target_clones compiles it for processors that
// have AVX2 and no more. Code around it stays baseline x86-64, so that types are laid out as everywhere.

#define TERRACAST_BASELINE_PACKETS  // no clones
#include "core/packet_code.h"

#if defined(__x86_64__)
#undef TERRACAST_PACKET_CODE
#define TERRACAST_PACKET_CODE __attribute__((target("avx2")))
#endif
