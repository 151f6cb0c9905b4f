#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/schema.h"
#include "sensors/drawn_noise.h"

/// Errors of an instrument of three axes.
namespace terracast::sensors {

/// Parameters of an instrument, as data sheets and Allan plots have them; 0: it has none of the kind.
struct InstrumentOptions {
  /// unit   of what it measures, as it ends names of keys: "radps"
  explicit InstrumentOptions(std::string unit_of_keys) : unit(std::move(unit_of_keys)) {}

  std::string unit;
  double noise_per_sqrt_hz =
      0.0;  ///< density of white noise; a sample's deviation is it times sqrt(rate)
  double walk_per_s_per_sqrt_hz = 0.0;  ///< density of the bias's derivative
  double markov = 0.0;                  ///< deviation of a Gauss-Markov bias
  double markov_s = 100.0;              ///< over which it correlates by 1/e
  double flicker = 0.0;                 ///< B of a 1/f bias, in the quantity's unit
  double turn_on = 0.0;                 ///< deviation of a constant bias
  double scale_ppm = 0.0;               ///< deviations, of each axis
  double misalignment_mrad = 0.0;       ///< and of each axis towards each other one
  double range = 0.0;                   ///< the most that it shows, either way
  double step = 0.0;                    ///< of its numbers

  void describe(core::SchemaVisitor& visit);
};

/// A number as it is shown: the nearest whole step, and no more than the range either way.
/// step, range   0: none
double shown_number(double value, double step, double range);

/// An instrument as it was drawn: it has one scale, misalignment and turn-on bias for all its stream.
///
/// determinism   what it shows at a tick depends on seed, stream, tick and truth alone
/// threads       one at a time
class Instrument {
 public:
  /// stream   of its random numbers alone
  Instrument(const InstrumentOptions& options, double rate_hz, std::uint64_t seed,
             std::uint64_t stream);

  /// shown = range(step((I + S + M) truth + turn-on + Gauss-Markov + walk + flicker + noise)), each axis by itself.
  /// tick   of the stream, 0 and more
  Eigen::Vector3d shown(const Eigen::Vector3d& truth, std::int64_t tick);
  /// The sum of turn-on, Gauss-Markov, walk and flicker at a tick.
  Eigen::Vector3d bias(std::int64_t tick);

 private:
  const InstrumentOptions& options_;
  Eigen::Matrix3d shown_from_true_;
  Eigen::Vector3d turn_on_;
  std::vector<DrawnNoise> noise_;  ///< of the three axes
};

}  // namespace terracast::sensors
