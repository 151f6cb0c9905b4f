#include "sensors/clock.h"

#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"
#include "sensors/deviates.h"

namespace terracast::sensors {
namespace {

/// No deviate is larger.
constexpr double kMostDeviations = 4.0;

/// A clock's random numbers, apart from those of its sensor.
enum ClockStream : std::uint64_t {
  kClockOffset = 0x636c6f636b00ULL,
  kClockDrift,
  kClockJitter,
};

/// A standard normal deviate of those within kMostDeviations.
double bounded_deviate(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  const double beyond = 0.5 * std::erfc(kMostDeviations / std::sqrt(2.0));
  const double unit = open_unit(core::random_bits(seed, stream, index));
  return normal_deviate(beyond + (1.0 - 2.0 * beyond) * unit);
}

/// The error of stamps about a clock.
class Jitter {
 public:
  Jitter(double deviation_s, std::uint64_t seed, double rate_hz)
      : deviation_s_(deviation_s), seed_(seed), rate_hz_(rate_hz) {}

  double at(double time_s) const {
    if (deviation_s_ == 0.0) return 0.0;
    auto tick = static_cast<std::int64_t>(std::floor(time_s * rate_hz_));
    if (static_cast<double>(tick + 1) / rate_hz_ <= time_s) ++tick;
    const double before_s = static_cast<double>(tick) / rate_hz_;
    if (time_s == before_s) return of_tick(tick);
    const double share = (time_s - before_s) * rate_hz_;
    return (1.0 - share) * of_tick(tick) + share * of_tick(tick + 1);
  }

 private:
  double of_tick(std::int64_t tick) const {
    return deviation_s_ * bounded_deviate(seed_, kClockJitter, static_cast<std::uint64_t>(tick));
  }
  double deviation_s_;
  std::uint64_t seed_;
  double rate_hz_;
};

}  // namespace

std::optional<capture::StreamClock> ClockOptions::believed() const {
  if (!is_on()) return std::nullopt;
  return capture::StreamClock{.offset_s = offset_s,
                              .drift = 1e-6 * drift_ppm,
                              .jitter_sd_s = jitter_sd_s,
                              .believed_offset_s = offset_s,
                              .believed_drift = 1e-6 * drift_ppm};
}

void ClockOptions::describe(core::SchemaVisitor& visit) {
  visit.key("offset_s", offset_s,
            "What the clock is believed to be ahead by at the sequence's start.",
            core::between(-1e6, 1e6));
  visit.key("offset_sd_s", offset_sd_s,
            "Standard deviation of what it is ahead by besides, drawn once a sequence.",
            core::between(0.0, 1e6));
  visit.key("drift_ppm", drift_ppm, "What it is believed to gain.", core::between(-1e5, 1e5));
  visit.key("drift_sd_ppm", drift_sd_ppm,
            "Standard deviation of what it gains besides, drawn once a sequence.",
            core::between(0.0, 1e4));
  visit.key("jitter_sd_s", jitter_sd_s,
            "Standard deviation of each tick's stamp about the clock; none is beyond four of them.",
            core::between(0.0, 1e3));
}

void ClockOptions::check_order(double rate_hz) const {
  const double slowest = 1.0 + 1e-6 * (drift_ppm - kMostDeviations * drift_sd_ppm);
  const double most_s = 0.5 * slowest / rate_hz / kMostDeviations;
  if (jitter_sd_s < most_s) return;
  core::fail(core::ErrorKind::Config,
             "clock.jitter_sd_s = {}: four deviations are half a period of rate_hz = {} or more, "
             "and stamps would come out of order; less than {:.6g} s, or a rate_hz below {:.6g}, "
             "would do",
             jitter_sd_s, rate_hz, most_s, 0.5 * slowest / jitter_sd_s / kMostDeviations);
}

capture::StreamClock drawn_clock(const ClockOptions& options, std::int64_t seed,
                                 const std::string& name) {
  capture::StreamClock clock = options.believed().value_or(capture::StreamClock{});
  const std::uint64_t stream = core::content_hash64(std::as_bytes(std::span(name)));
  const auto deviate = [&](ClockStream of) {
    return bounded_deviate(static_cast<std::uint64_t>(seed), core::stream_of(stream, of), 0);
  };
  clock.offset_s += options.offset_sd_s * deviate(kClockOffset);
  clock.drift += 1e-6 * options.drift_sd_ppm * deviate(kClockDrift);
  return clock;
}

void add_stamps(const capture::StreamClock& clock, std::uint64_t stream_seed, double rate_hz,
                std::size_t num_channels, capture::Samples& samples) {
  std::vector<double> values;
  values.reserve(samples.values.size() + samples.times_s.size());
  const Jitter jitter(clock.jitter_sd_s, stream_seed, rate_hz);
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    const double time_s = samples.times_s[i];
    const auto row = samples.values.begin() + static_cast<std::ptrdiff_t>(i * num_channels);
    values.insert(values.end(), row, row + static_cast<std::ptrdiff_t>(num_channels));
    values.push_back(clock.reading_s(time_s) + jitter.at(time_s));
  }
  samples.values = std::move(values);
}

}  // namespace terracast::sensors
