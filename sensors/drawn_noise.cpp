#include "sensors/drawn_noise.h"

#include <cmath>
#include <numbers>

#include "core/random.h"
#include "sensors/deviates.h"

namespace terracast::sensors {

double drawn_constant(double deviation, std::uint64_t seed, std::uint64_t stream,
                      std::uint64_t purpose, std::uint64_t index) {
  return deviation * normal_deviate(open_unit(
                         core::random_bits(seed, core::stream_of(stream, purpose), index)));
}

DrawnNoise::DrawnNoise(const NoiseSizes& sizes, std::uint64_t seed, std::uint64_t stream,
                       std::uint64_t axis)
    : white_(sizes.white), seed_(seed) {
  const auto of = [&](NoisePurpose purpose) {
    return core::stream_of(core::stream_of(stream, purpose), axis);
  };
  white_stream_ = of(kWhiteNoise);
  if (sizes.walk > 0.0) slow_.push_back(DrawnProcess::walk(sizes.walk, seed, of(kRandomWalk)));
  if (sizes.markov > 0.0)
    slow_.push_back(DrawnProcess::markov(sizes.markov, sizes.markov_ticks, seed, of(kMarkovBias)));
  if (sizes.flicker > 0.0) {
    // Processes of one deviation s whose times go up by r have together the spectrum s^2 / (2 f ln r).
    constexpr double kRatio = 4.0;
    const double deviation = sizes.flicker * std::sqrt(std::log(kRatio) / std::numbers::pi);
    std::uint64_t index = 0;
    for (double ticks = 1.0; ticks <= kRatio * sizes.flicker_ticks; ticks *= kRatio)
      slow_.push_back(
          DrawnProcess::markov(deviation, ticks, seed, core::stream_of(of(kFlicker), index++)));
  }
}

double DrawnNoise::slow(std::int64_t tick) {
  double sum = 0.0;
  for (DrawnProcess& process : slow_) sum += process.at(tick);
  return sum;
}

double DrawnNoise::added_to(double value, std::int64_t tick) {
  for (DrawnProcess& process : slow_) value += process.at(tick);
  if (white_ > 0.0)
    value += white_ * normal_deviate(open_unit(core::random_bits(
                          seed_, white_stream_, static_cast<std::uint64_t>(tick))));
  return value;
}

}  // namespace terracast::sensors
