#pragma once

#include <array>
#include <cstdint>

#include "sensors/drawn_by_halving.h"

/// Slow random processes of instruments, with access to any tick without those before it.
namespace terracast::sensors {

/// A random walk or a Gauss-Markov process at the ticks 0, 1, 2, … of a stream, drawn by halving: the middle of an
/// interval follows from its ends and a number of its own, so that a tick's value is the same whichever others are asked.
///
/// accuracy   its distribution is the process's own at the ticks, by its means and covariances (DrawnProcess.…)
/// cost       of DrawnByHalving
/// source     Lévy's construction of Brownian motion; for Gauss-Markov the conditional normal of the middle of three values
/// threads    one at a time
class DrawnProcess {
 public:
  /// 0 at tick 0; from tick to tick it gains a normal deviate times `step`.
  /// stream   of its numbers alone
  static DrawnProcess walk(double step, std::uint64_t seed, std::uint64_t stream);
  /// Stationary, of one deviation; its correlation over n ticks is exp(-n / ticks).
  static DrawnProcess markov(double deviation, double ticks, std::uint64_t seed,
                             std::uint64_t stream);

  /// tick   0 to 2^40
  double at(std::int64_t tick);

 private:
  using Values = DrawnByHalving<double>;
  /// How the middle of an interval follows from its ends: their sum times a weight, and a deviate.
  struct Halving {
    double weight = 0.5;
    double deviation = 0.0;
  };

  DrawnProcess(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}
  double deviate(std::int64_t tick) const;

  std::uint64_t seed_, stream_;
  std::array<Halving, Values::kDepth> halvings_;  ///< of intervals of 2^(kDepth - depth) ticks
  Values values_{0.0, 0.0};
};

/// What is on or off, for times that are exponentially distributed: at the ticks 0, 1, 2, … of a stream, drawn as a
/// DrawnProcess is. Stationary: at tick 0 it is on with the share of time that it is on.
///
/// accuracy   its distribution is the process's own at the ticks (DrawnSwitch.…); what begins and ends between two ticks
///            does not show
/// threads    one at a time
class DrawnSwitch {
 public:
  /// mean_on_ticks, mean_off_ticks   how long it is on and off in the mean; above 0
  /// stream                          of its numbers alone
  DrawnSwitch(double mean_on_ticks, double mean_off_ticks, std::uint64_t seed,
              std::uint64_t stream);

  /// tick   0 to 2^40
  bool is_on(std::int64_t tick);

 private:
  using Values = DrawnByHalving<bool>;
  /// Probability that it is `to` so many ticks after it was `from`.
  double probability(bool from, bool to, double ticks) const;
  bool drawn(std::int64_t tick, double share_on) const;

  double share_on_, rate_;  ///< rate_: at which what it was is forgotten, a tick
  std::uint64_t seed_, stream_;
  Values values_;
};

}  // namespace terracast::sensors
