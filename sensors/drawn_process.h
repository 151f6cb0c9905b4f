#pragma once

#include <array>
#include <cstdint>

/// Slow random processes of instruments, with access to any tick without those before it.
namespace terracast::sensors {

/// A random walk or a Gauss-Markov process at the ticks 0, 1, 2, … of a stream, drawn by halving: the middle of an
/// interval follows from its ends and a number of its own, so that a tick's value is the same whichever others are asked.
///
/// accuracy   its distribution is the process's own at the ticks, by its means and covariances (DrawnProcess.…)
/// cost       41 random numbers for a tick alone, two in the mean where ticks are asked in order
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
  static constexpr int kDepth = 40;
  /// How the middle of an interval follows from its ends: their sum times a weight, and a deviate.
  struct Halving {
    double weight = 0.5;
    double deviation = 0.0;
  };
  struct Interval {
    std::int64_t first = 0;
    double at_first = 0.0, at_end = 0.0;
  };

  DrawnProcess(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}
  double deviate(std::int64_t tick) const;

  std::uint64_t seed_, stream_;
  std::array<Halving, kDepth> halvings_;          ///< of intervals of 2^(kDepth - depth) ticks
  std::array<Interval, kDepth + 1> intervals_{};  ///< around the tick that was asked last
  int known_depth_ = 0;
};

}  // namespace terracast::sensors
