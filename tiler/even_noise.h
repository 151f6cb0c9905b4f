#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tiler/gradient_noise.h"

namespace terracast::tiler {

/// Fractal noise whose values are told by how many of them lie below: evenly within 0 to 1, so that a
/// share s of all places lies below s.
///
/// threads   safe
class EvenNoise {
 public:
  EvenNoise(std::uint64_t seed, std::uint64_t stream, double period_m, int num_octaves);
  double operator()(const Eigen::Vector2d& place_world) const;

 private:
  static constexpr std::size_t kNumBuckets = 4096;
  double value(const Eigen::Vector2d& place_world) const;
  /// Rises with the value, from 0 to kNumBuckets - 1.
  std::size_t bucket(double value) const;
  GradientNoise noise_;
  double period_m_;
  int num_octaves_;
  std::vector<double> sorted_;       ///< values at scattered places
  std::vector<std::size_t> starts_;  ///< of each bucket, in sorted_; and its size
};

}  // namespace terracast::tiler
