#pragma once

#include <cstddef>
#include <cstdint>

#include "core/random.h"

namespace terracast::test {

/// Random choices that follow from a seed.
class Dice {
 public:
  Dice(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}
  std::uint64_t bits() { return core::random_bits(seed_, stream_, next_++); }
  double between(double lowest, double highest) {
    return core::random_between(lowest, highest, seed_, stream_, next_++);
  }
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(bits() % count); }
  bool chance(double probability) { return between(0.0, 1.0) < probability; }

 private:
  std::uint64_t seed_, stream_, next_ = 0;
};

}  // namespace terracast::test
