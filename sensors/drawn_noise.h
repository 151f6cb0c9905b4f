#pragma once

#include <cstdint>
#include <vector>

#include "sensors/drawn_process.h"

namespace terracast::sensors {

/// What random numbers of an instrument's errors are for, each by a stream of its own.
enum NoisePurpose : std::uint64_t {
  kWhiteNoise,
  kRandomWalk,
  kMarkovBias,
  kTurnOnBias,
  kNumNoisePurposes
};

/// A number of a deviation, drawn once.
double drawn_constant(double deviation, std::uint64_t seed, std::uint64_t stream,
                      std::uint64_t purpose, std::uint64_t index);

/// Sizes of what noise adds to a quantity; 0: it has none of the kind.
struct NoiseSizes {
  double white = 0.0;            ///< deviation of a sample
  double walk = 0.0;             ///< deviation of what a random walk gains from tick to tick
  double markov = 0.0;           ///< deviation of a Gauss-Markov process
  double markov_ticks = 1000.0;  ///< over which it correlates by 1/e
};

/// White noise, a random walk and a Gauss-Markov process of one quantity.
///
/// determinism   what it adds at a tick depends on seed, stream, axis and tick alone
/// threads       one at a time
class DrawnNoise {
 public:
  /// stream, axis   of its random numbers alone
  DrawnNoise(const NoiseSizes& sizes, std::uint64_t seed, std::uint64_t stream, std::uint64_t axis);

  /// tick   of the stream, 0 and more
  double added_to(double value, std::int64_t tick);
  /// The random walk and the Gauss-Markov process together.
  double slow(std::int64_t tick);

 private:
  double white_;
  std::uint64_t seed_, white_stream_;
  std::vector<DrawnProcess> slow_;
};

}  // namespace terracast::sensors
