#include "sensors/instrument_errors.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "sensors/deviates.h"

namespace terracast::sensors {

namespace {

/// What random numbers are for, each by a stream of its own.
enum Purpose : std::uint64_t { kNoise, kWalk, kMarkov, kTurnOn, kScale, kMisalignment };

double drawn(std::uint64_t seed, std::uint64_t stream, Purpose purpose, std::uint64_t index) {
  return normal_deviate(
      open_unit(core::random_bits(seed, core::stream_of(stream, purpose), index)));
}

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
    : options_(options), seed_(seed), noise_(options.noise_per_sqrt_hz * std::sqrt(rate_hz)) {
  const auto axes = [&](Purpose purpose, double deviation) -> Eigen::Vector3d {
    return deviation * Eigen::Vector3d(drawn(seed, stream, purpose, 0),
                                       drawn(seed, stream, purpose, 1),
                                       drawn(seed, stream, purpose, 2));
  };
  turn_on_ = axes(kTurnOn, options.turn_on);
  shown_from_true_ = Eigen::Matrix3d::Identity();
  shown_from_true_.diagonal() += axes(kScale, 1e-6 * options.scale_ppm);
  for (int row = 0, index = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      if (row != column)
        shown_from_true_(row, column) +=
            1e-3 * options.misalignment_mrad *
            drawn(seed, stream, kMisalignment, static_cast<std::uint64_t>(index++));
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    const auto of = [&](Purpose purpose) {
      return core::stream_of(core::stream_of(stream, purpose), axis);
    };
    noise_streams_[axis] = of(kNoise);
    if (options.walk_per_s_per_sqrt_hz > 0.0)
      slow_.push_back(
          DrawnProcess::walk(options.walk_per_s_per_sqrt_hz / std::sqrt(rate_hz), seed, of(kWalk)));
  }
  for (std::uint64_t axis = 0; axis < 3 && options.markov > 0.0; ++axis)
    slow_.push_back(DrawnProcess::markov(options.markov, options.markov_s * rate_hz, seed,
                                         core::stream_of(core::stream_of(stream, kMarkov), axis)));
}

Eigen::Vector3d Instrument::shown(const Eigen::Vector3d& truth, std::int64_t tick) {
  Eigen::Vector3d shown = shown_from_true_ * truth + turn_on_;
  for (std::size_t i = 0; i < slow_.size(); ++i)
    shown[static_cast<Eigen::Index>(i % 3)] += slow_[i].at(tick);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    double& value = shown[axis];
    if (noise_ > 0.0)
      value += noise_ * normal_deviate(open_unit(
                            core::random_bits(seed_, noise_streams_[static_cast<std::size_t>(axis)],
                                              static_cast<std::uint64_t>(tick))));
    if (options_.step > 0.0) value = options_.step * std::round(value / options_.step);
    if (options_.range > 0.0) value = std::clamp(value, -options_.range, options_.range);
  }
  return shown;
}

}  // namespace terracast::sensors
