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
  kFlicker,
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
  double flicker = 0.0;          ///< B of 1/f noise: the Allan deviation is sqrt(2 ln 2 / pi) B
  double flicker_ticks = 1e7;    ///< it correlates over times up to this; 1 and more
};

/// White noise, a random walk, a Gauss-Markov process and flicker noise of one quantity.
///
/// accuracy      flicker is a sum of Gauss-Markov processes whose times go up by fours from one tick: of the spectrum
///               B^2 / (2 pi f) (two sides) it is within 0.4 % in between, and its Allan deviation within 2 % of the line
///               from 10 ticks to a tenth of flicker_ticks, 5 % below it at two ticks, by the processes' closed forms
///               (Imu.FlickerIsAFlatLine draws them from 10 to 5000 ticks)
/// source        IEEE Std 952, annex C, for B and the line
/// determinism   what it adds at a tick depends on seed, stream, axis and tick alone
/// threads       one at a time
class DrawnNoise {
 public:
  /// stream, axis   of its random numbers alone
  DrawnNoise(const NoiseSizes& sizes, std::uint64_t seed, std::uint64_t stream, std::uint64_t axis);

  /// tick   of the stream, 0 and more
  double added_to(double value, std::int64_t tick);
  /// All but the white noise.
  double slow(std::int64_t tick);

 private:
  double white_;
  std::uint64_t seed_, white_stream_;
  std::vector<DrawnProcess> slow_;
};

}  // namespace terracast::sensors
