#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "capture/stream.h"
#include "core/schema.h"

namespace terracast::sensors {

/// Config `[clock]` of a sensor: what is believed of its clock, and how far the clock is from that.
struct ClockOptions {
  double offset_s = 0.0;
  double offset_sd_s = 0.0;
  double drift_ppm = 0.0;
  double drift_sd_ppm = 0.0;
  double jitter_sd_s = 0.0;

  bool operator==(const ClockOptions&) const = default;
  /// With all keys 0 the clock shows the time, and there are no stamps.
  bool is_on() const { return *this != ClockOptions{}; }
  /// Nothing where it is not on.
  std::optional<capture::StreamClock> believed() const;

  void describe(core::SchemaVisitor& visit);
  /// throws   Config: stamps of so many ticks a second could come out of order
  void check_order(double rate_hz) const;
};

/// Draws what a clock is by the seed and a name alone, within four deviations of what is believed.
capture::StreamClock drawn_clock(const ClockOptions& options, std::int64_t seed,
                                 const std::string& name);

/// Adds what a clock shows as the last channel.
/// num_channels   of the samples before
/// determinism    a stamp depends on the clock, the seed, the rate and the sample's time alone
void add_stamps(const capture::StreamClock& clock, std::uint64_t stream_seed, double rate_hz,
                std::size_t num_channels, capture::Samples& samples);

}  // namespace terracast::sensors
