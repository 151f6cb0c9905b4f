#pragma once

#include <cmath>
#include <cstdint>

#include "core/schema.h"
#include "sensors/drawn_noise.h"
#include "sensors/instrument_errors.h"
#include "sensors/sensor.h"

namespace terracast::sensors {

/// Errors of an instrument of pressure; 0: it has none of the kind.
struct PressureErrors {
  double noise_pa = 0.0;
  double walk_pa_per_sqrt_s = 0.0;
  double markov_pa = 0.0;
  double markov_s = 1000.0;
  double turn_on_pa = 0.0;
  double step_pa = 0.0;

  void describe(core::SchemaVisitor& visit) {
    const core::Constraint positive = core::between(0.0, 1e5);
    visit.key("noise_pa", noise_pa, "Deviation of an error that each sample has anew.", positive);
    visit.key("walk_pa_per_sqrt_s", walk_pa_per_sqrt_s,
              "Deviation of what a drift gains over a second; over t seconds it is sqrt(t) of it.",
              positive);
    visit.key("markov_pa", markov_pa, "Deviation of a drift that wanders and comes back.",
              positive);
    visit.key("markov_s", markov_s, "Over this time that drift correlates by 1/e.",
              core::between(1e-3, 1e9));
    visit.key("turn_on_pa", turn_on_pa, "Deviation of an offset that stays, drawn by the seed.",
              positive);
    visit.key("step_pa", step_pa, "Step of the numbers that are shown; 0: doubles.", positive);
  }
};

/// An instrument of pressure as it was drawn. Threads: one at a time.
class PressureInstrument {
 public:
  /// range_pa   the most that it shows, either way; 0: no limit
  PressureInstrument(const PressureErrors& errors, const SensorSite& site, double range_pa)
      : noise_({.white = errors.noise_pa,
                .walk = errors.walk_pa_per_sqrt_s / std::sqrt(site.rate_hz),
                .markov = errors.markov_pa,
                .markov_ticks = errors.markov_s * site.rate_hz},
               site.stream_seed, kErrors, 0),
        turn_on_pa_(drawn_constant(errors.turn_on_pa, site.stream_seed, kErrors, kTurnOnBias, 0)),
        step_pa_(errors.step_pa),
        range_pa_(range_pa) {}

  double shown_pa(double truth_pa, std::int64_t tick) {
    return shown_number(noise_.added_to(truth_pa + turn_on_pa_, tick), step_pa_, range_pa_);
  }

 private:
  static constexpr std::uint64_t kErrors = 1;  ///< stream of random numbers

  DrawnNoise noise_;
  double turn_on_pa_, step_pa_, range_pa_;
};

}  // namespace terracast::sensors
