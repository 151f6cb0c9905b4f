#include "tiler/even_noise.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler {

EvenNoise::EvenNoise(std::uint64_t seed, std::uint64_t stream, double period_m, int num_octaves)
    : noise_(seed, stream), period_m_(period_m), num_octaves_(num_octaves) {
  constexpr int kNumPlaces = 8192;
  for (int i = 0; i < kNumPlaces; ++i)  // R2 low-discrepancy sequence (Roberts 2018)
    sorted_.push_back(value(1000.0 * period_m *
                            Eigen::Vector2d(std::fmod(0.7548776662466927 * i, 1.0),
                                            std::fmod(0.5698402909980532 * i, 1.0))));
  std::sort(sorted_.begin(), sorted_.end());
  starts_.assign(kNumBuckets + 1, sorted_.size());
  for (std::size_t i = sorted_.size(); i-- > 0;) starts_[bucket(sorted_[i])] = i;
  for (std::size_t b = kNumBuckets; b-- > 0;) starts_[b] = std::min(starts_[b], starts_[b + 1]);
}

std::size_t EvenNoise::bucket(double value) const {
  const double share = (value - sorted_.front()) / (sorted_.back() - sorted_.front());
  return static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * (kNumBuckets - 1));
}

double EvenNoise::value(const Eigen::Vector2d& place_world) const {
  const Eigen::Vector2d at = place_world / period_m_;
  return fractal_noise(noise_, at.x(), at.y(), num_octaves_, 0.55);
}

double EvenNoise::operator()(const Eigen::Vector2d& place_world) const {
  const double here = value(place_world);
  const auto from = [&](std::size_t b) {
    return sorted_.begin() + static_cast<std::ptrdiff_t>(starts_[b]);
  };
  // Buckets are in the order of their values: what lies in others is known to be less, or not.
  const std::size_t b = bucket(here);
  const auto below = std::lower_bound(from(b), from(b + 1), here);
  return static_cast<double>(below - sorted_.begin()) / static_cast<double>(sorted_.size());
}

}  // namespace terracast::tiler
