#pragma once

/// Functions over packets that are compiled three times, for baseline x86-64 (which has no 32-bit
/// vector multiply), for AVX2 and for AVX-512; the processor's own is taken at run time. All do the
/// same IEEE operations in the same order, so that their results are equal bit for bit. What they call
/// must be TERRACAST_PACKET_INLINE to be compiled with them. TERRACAST_BASELINE_PACKETS compiles
/// the baseline only, for the test that compares it with the processor's own; so does the thread sanitizer, whose code must not run
/// while the loader still chooses.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(TERRACAST_BASELINE_PACKETS) && !defined(__SANITIZE_THREAD__)
#define TERRACAST_PACKET_CODE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define TERRACAST_PACKET_CODE
#endif
#define TERRACAST_PACKET_INLINE inline __attribute__((always_inline))

namespace terracast::core {

// Unlike std::min and std::max these hold no references, so that loops of them become vector code.
// Where either is no number it is b.
template <class T>
TERRACAST_PACKET_INLINE T smaller(T a, T b) {
  return a < b ? a : b;
}
template <class T>
TERRACAST_PACKET_INLINE T larger(T a, T b) {
  return a > b ? a : b;
}

// Loops become vector code only where what they compare, choose and store is of one width: a truth
// that comes from doubles is a double, 0 or 1, until a loop of its own makes it an integer.
TERRACAST_PACKET_INLINE double truth(bool is_so) { return is_so ? 1.0 : 0.0; }

}  // namespace terracast::core
