#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "core/random.h"

namespace terracast::render {

/// Where in a pixel and on the sun's disc the samples of a pixel lie: a function of the seed and
/// the pixel alone. For a power of two of samples the places in the pixel are a (0, 2) net: one in
/// each row and column strip.
class PixelSampler {
 public:
  /// stream   of the frame and camera
  PixelSampler(std::uint64_t seed, std::uint64_t stream, std::uint64_t pixel_index, int num_samples)
      : bits_(core::random_bits(seed, stream, pixel_index)), num_samples_(num_samples) {}

  /// In [0, 1)^2.
  Eigen::Vector2d place_in_pixel(int sample) const {
    const double jitter =
        static_cast<double>((core::mix_bits(bits_ + static_cast<std::uint64_t>(sample))) >> 11) *
        0x1.0p-53;
    return {(sample + jitter) / num_samples_,
            scrambled(sample, static_cast<std::uint32_t>(bits_ >> 32))};
  }

  /// In the unit disc, uniform.
  Eigen::Vector2d place_on_disc(int sample) const {
    const double radius = std::sqrt(scrambled(sample, static_cast<std::uint32_t>(bits_)));
    // Turns by the golden angle, from a start of the pixel's own.
    const double turn = 6.283185307179586 * (static_cast<double>(bits_ & 0xffffffu) * 0x1.0p-24 +
                                             0.6180339887498949 * sample);
    return {radius * std::cos(turn), radius * std::sin(turn)};
  }

 private:
  /// Van der Corput's sequence with its bits flipped by a mask.
  static double scrambled(int sample, std::uint32_t mask) {
    auto bits = static_cast<std::uint32_t>(sample);
    std::uint32_t reversed = 0;
    for (int i = 0; i < 32; ++i, bits >>= 1) reversed = reversed << 1 | (bits & 1u);
    return static_cast<double>(reversed ^ mask) * 0x1.0p-32;
  }

  std::uint64_t bits_;
  int num_samples_;
};

}  // namespace terracast::render
