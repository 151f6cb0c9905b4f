#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "core/random.h"

namespace terracast::scene {

/// Where in a pixel and on the sun's disc the samples of a pixel lie: a function of the seed and
/// the pixel alone. For a power of two of samples the places in the pixel are a (0, 2) net: one in
/// each row and column strip.
class PixelSampler {
 public:
  explicit PixelSampler(int num_samples) : num_samples_(num_samples) {
    for (int sample = 0; sample < num_samples; ++sample)
      reversed_.push_back(reverse_bits(static_cast<std::uint32_t>(sample)));
    for (std::size_t i = 0; i < kTurns; ++i) {
      const double angle = 2.0 * std::numbers::pi * static_cast<double>(i) / kTurns;
      turns_[i] = {std::cos(angle), std::sin(angle)};
    }
  }

  /// bits   of the pixel: core::random_bits
  /// returns   in [0, 1)^2
  Eigen::Vector2d place_in_pixel(std::uint64_t bits, int sample) const {
    const std::uint64_t jitter = core::mix_bits(bits + static_cast<std::uint64_t>(sample));
    return {(sample + static_cast<double>(jitter >> 11) * 0x1.0p-53) / num_samples_,
            scrambled(sample, static_cast<std::uint32_t>(bits >> 32))};
  }

  /// In [0, 1): for a power of two of samples, one in each of as many parts.
  double place_between(std::uint64_t bits, int sample) const {
    return scrambled(sample, static_cast<std::uint32_t>(core::mix_bits(bits ^ 0x7370726561ULL)));
  }

  /// In [0, 1), one in each of as many parts, in an order of the pixel's own: when a sample is taken.
  double place_in_time(std::uint64_t bits, int sample) const {
    const std::uint64_t own = core::mix_bits(bits ^ 0x74696d65ULL);
    const auto count = static_cast<std::uint64_t>(num_samples_);
    // An odd step goes round a power of two of parts.
    const std::uint64_t step = (count & (count - 1)) == 0 ? (own >> 32) | 1U : 1U;
    const std::uint64_t part =
        (static_cast<std::uint64_t>(sample) * step + (own & 0xffffffffU)) % count;
    const std::uint64_t jitter = core::mix_bits(own + static_cast<std::uint64_t>(sample));
    return (static_cast<double>(part) + static_cast<double>(jitter >> 11) * 0x1.0p-53) /
           num_samples_;
  }

  /// In the unit disc; uniform over pixels.
  Eigen::Vector2d place_on_disc(std::uint64_t bits, int sample) const {
    const double radius = std::sqrt(scrambled(sample, static_cast<std::uint32_t>(bits)));
    // About the golden angle from sample to sample, from a start of the pixel's own.
    const std::uint64_t turn = (bits >> 8) + 633 * static_cast<std::uint64_t>(sample);
    return radius * turns_[turn % kTurns];
  }

 private:
  static constexpr std::size_t kTurns = 1024;

  static std::uint32_t reverse_bits(std::uint32_t bits) {
    std::uint32_t reversed = 0;
    for (int i = 0; i < 32; ++i, bits >>= 1) reversed = reversed << 1 | (bits & 1u);
    return reversed;
  }
  /// Van der Corput's sequence with its bits flipped by a mask.
  double scrambled(int sample, std::uint32_t mask) const {
    return static_cast<double>(reversed_[static_cast<std::size_t>(sample)] ^ mask) * 0x1.0p-32;
  }

  int num_samples_;
  std::vector<std::uint32_t> reversed_;
  std::array<Eigen::Vector2d, kTurns> turns_;
};

}  // namespace terracast::scene
