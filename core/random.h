#pragma once

#include <cstdint>

/// Counter-based random numbers: a pure function of seed, stream and index, with no state, so that
/// a value does not depend on what was drawn before it.
namespace terracast::core {

/// A bijective mixing of 64 bits (the finaliser of SplitMix64, Steele et al. 2014).
constexpr std::uint64_t mix_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// A 64-bit value for (seed, stream, index).
constexpr std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return mix_bits(mix_bits(mix_bits(seed) ^ stream) ^ index);
}

/// Folds another counter into a stream: stream_of(stream_of(seed, frame), camera) …
constexpr std::uint64_t stream_of(std::uint64_t stream, std::uint64_t counter) {
  return mix_bits(mix_bits(stream) ^ (counter * 0xd6e8feb86659fd93ULL + 1));
}

/// Uniform in [0, 1), 53 bits.
constexpr double random_unit(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return static_cast<double>(random_bits(seed, stream, index) >> 11) * 0x1.0p-53;
}

/// Uniform in [lowest, highest).
constexpr double random_between(double lowest, double highest, std::uint64_t seed,
                                std::uint64_t stream, std::uint64_t index) {
  return lowest + (highest - lowest) * random_unit(seed, stream, index);
}

}  // namespace terracast::core
