#include "sensors/instrument_errors.h"

#include <algorithm>
#include <cmath>

namespace terracast::sensors {

namespace {

/// What random numbers beside those of noise are for, each by a stream of its own.
enum Purpose : std::uint64_t { kScale = kNumNoisePurposes, kMisalignment };

/// Flicker noise goes on to this time, beyond which it is a bias that stays: most flights are shorter.
constexpr double kFlicker_s = 1e5;

}  // namespace

void InstrumentOptions::describe(core::SchemaVisitor& visit) {
  const core::Constraint positive = core::at_least(0.0);
  visit.key("noise_" + unit + "_per_sqrt_hz", noise_per_sqrt_hz,
            "Density of white noise (angle or velocity random walk).", positive);
  visit.key("walk_" + unit + "_per_s_per_sqrt_hz", walk_per_s_per_sqrt_hz,
            "Density of the noise that the bias gathers: its random walk.", positive);
  visit.key("markov_" + unit, markov, "Deviation of a bias that wanders and comes back.", positive);
  visit.key("markov_s", markov_s, "Over this time that bias correlates by 1/e.",
            core::between(1e-3, 1e9));
  visit.key("flicker_" + unit, flicker,
            "Bias instability: B of flicker noise, whose line on an Allan plot is flat at 0.664 B.",
            positive);
  visit.key("turn_on_" + unit, turn_on, "Deviation of a bias that stays, drawn by the seed.",
            positive);
  visit.key("scale_ppm", scale_ppm, "Deviation of each axis's scale, in millionths.",
            core::between(0.0, 1e5));
  visit.key("misalignment_mrad", misalignment_mrad,
            "Deviation of the angle of each axis towards each other one.",
            core::between(0.0, 100.0));
  visit.key("range_" + unit, range, "The most that is shown, either way; 0: all.", positive);
  visit.key("step_" + unit, step, "Step of the numbers that are shown; 0: doubles.", positive);
}

Instrument::Instrument(const InstrumentOptions& options, double rate_hz, std::uint64_t seed,
                       std::uint64_t stream)
    : options_(options) {
  const auto axes = [&](std::uint64_t purpose, double deviation) -> Eigen::Vector3d {
    return {drawn_constant(deviation, seed, stream, purpose, 0),
            drawn_constant(deviation, seed, stream, purpose, 1),
            drawn_constant(deviation, seed, stream, purpose, 2)};
  };
  turn_on_ = axes(kTurnOnBias, options.turn_on);
  shown_from_true_ = Eigen::Matrix3d::Identity();
  shown_from_true_.diagonal() += axes(kScale, 1e-6 * options.scale_ppm);
  for (int row = 0, index = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      if (row != column)
        shown_from_true_(row, column) +=
            drawn_constant(1e-3 * options.misalignment_mrad, seed, stream, kMisalignment,
                           static_cast<std::uint64_t>(index++));
  const NoiseSizes sizes{.white = options.noise_per_sqrt_hz * std::sqrt(rate_hz),
                         .walk = options.walk_per_s_per_sqrt_hz / std::sqrt(rate_hz),
                         .markov = options.markov,
                         .markov_ticks = options.markov_s * rate_hz,
                         .flicker = options.flicker,
                         .flicker_ticks = kFlicker_s * rate_hz};
  for (std::uint64_t axis = 0; axis < 3; ++axis) noise_.emplace_back(sizes, seed, stream, axis);
}

double shown_number(double value, double step, double range) {
  if (step > 0.0) value = step * std::round(value / step);
  if (range > 0.0) value = std::clamp(value, -range, range);
  return value;
}

Eigen::Vector3d Instrument::bias(std::int64_t tick) {
  Eigen::Vector3d bias = turn_on_;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    bias[axis] += noise_[static_cast<std::size_t>(axis)].slow(tick);
  return bias;
}

Eigen::Vector3d Instrument::shown(const Eigen::Vector3d& truth, std::int64_t tick) {
  Eigen::Vector3d shown = shown_from_true_ * truth + turn_on_;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    shown[axis] = shown_number(noise_[static_cast<std::size_t>(axis)].added_to(shown[axis], tick),
                               options_.step, options_.range);
  return shown;
}

}  // namespace terracast::sensors
