#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <string_view>

#include "core/random.h"

namespace terracast::test {

/// The random draws for one part of a job. Each part has its own stream, so an extra draw in one part changes no other part.
class Draws {
 public:
  /// part   "rig 0", "flight"
  Draws(std::uint64_t seed, std::string_view part) : seed_(seed) {
    for (const char letter : part)
      stream_ = core::stream_of(stream_, static_cast<unsigned char>(letter));
  }

  std::uint64_t seed() const { return seed_; }
  double unit() { return core::random_unit(seed_, stream_, index_++); }
  bool chance(double probability) { return unit() < probability; }
  double between(double lowest, double highest) { return lowest + (highest - lowest) * unit(); }
  /// Its logarithm is even.
  double log_between(double lowest, double highest) {
    return std::exp(between(std::log(lowest), std::log(highest)));
  }
  double both_ways(double most) { return between(-most, most); }
  int below(int count) { return static_cast<int>(unit() * count); }
  template <class Value>
  Value among(std::initializer_list<Value> values) {
    return values.begin()[below(static_cast<int>(values.size()))];
  }
  /// The index of one of several weights, by these.
  int weighted(std::initializer_list<double> weights) {
    double sum = 0.0;
    for (const double weight : weights) sum += weight;
    double at = sum * unit();
    int index = 0;
    for (const double weight : weights) {
      if (at < weight) return index;
      at -= weight;
      ++index;
    }
    return static_cast<int>(weights.size()) - 1;
  }

 private:
  std::uint64_t seed_;
  std::uint64_t stream_ = 0;
  std::uint64_t index_ = 0;
};

}  // namespace terracast::test
