#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geo/rigid3.h"

namespace terracast::capture {

/// How the numbers of a scan's channel are stored: floating-point numbers and counts, by their bytes.
enum class NumberType : std::uint8_t { Float64, Float32, Count32, Count16, Count8 };

/// One quantity that a sensor measures.
struct StreamChannel {
  std::string name;  ///< "range_m": with its unit, where it has one; a to z, 0 to 9 and _
  std::string unit;  ///< "m", "m/s^2"; empty: none
  NumberType type = NumberType::Float64;  ///< of a scan; of others it is this one
  bool operator==(const StreamChannel&) const = default;
};

/// Why a sensor cannot have these channels: too few or too many, a name that is there twice, or a name or unit that cannot
/// head a column of a table ("time_s" heads the first one). Names in the text are raw, not printable. Empty: it can.
std::string wrong_channels(std::span<const StreamChannel> channels);

/// A sensor's clock against the sequence's time t: it shows t + offset_s + drift t. Each tick's stamp errs besides by a
/// normal deviate of jitter_sd_s, within four deviations; between two ticks, as of the rows of a scan, that error runs evenly
/// from the one's to the next one's, so that stamps are in the order of time.
struct StreamClock {
  double offset_s = 0.0;
  double drift = 0.0;  ///< seconds a second
  double jitter_sd_s = 0.0;
  double believed_offset_s = 0.0;  ///< what a calibration says of it
  double believed_drift = 0.0;
  bool operator==(const StreamClock&) const = default;

  double reading_s(double time_s) const { return time_s + offset_s + drift * time_s; }
};

/// The last channel of a sensor with a clock of its own: what the clock showed, s.
inline constexpr const char* kStampChannel = "stamp_s";

/// A sensor that measures at times of its own, and its channels. Its folder in the capture is `<rig>/<name>`.
struct StreamInfo {
  std::string rig;
  std::string name;
  std::string kind;  ///< of the table of sensors
  double rate_hz = 0.0;
  std::vector<StreamChannel> channels;
  geo::Rigid3d rig_from_sensor;  ///< sensor: x forward, y left, z up
  geo::Rigid3d body_from_rig;
  std::string settings_toml;  ///< the kind's own keys, every one
  /// Each tick gives a scan: any number of rows, each at its own time from the tick's to before the next one's.
  bool is_scan = false;
  std::optional<StreamClock> clock = {};  ///< nothing: it shows the time, and there are no stamps
  bool operator==(const StreamInfo&) const = default;

  geo::Rigid3d body_from_sensor() const { return body_from_rig * rig_from_sensor; }
};

/// Measurements of a stream, in the order of time.
struct Samples {
  std::vector<double>
      times_s;  ///< true, since the sequence's start; of a scan several may be the same
  std::vector<double> values;  ///< the channels of the first time, of the second, …
  bool operator==(const Samples&) const = default;
};

/// Measurements that one frame's file holds: ticks first … end - 1, each at tick / rate_hz.
struct TickRange {
  std::int64_t first = 0;
  std::int64_t end = 0;
};

/// The ticks from a frame's time to before the next frame's; of the last frame those at its own time. Frames stand at
/// frame / frame_rate_hz.
TickRange ticks_of_frame(double rate_hz, double frame_rate_hz, int frame, int num_frames);

/// tick / rate_hz for each.
std::vector<double> times_of(const TickRange& ticks, double rate_hz);

/// A NumPy array of doubles, (number of samples) x (1 + number of channels): the time, then the channels.
std::vector<std::byte> encode_samples(const Samples& samples, std::size_t num_channels);

/// times_s   of the samples that the file must hold
/// throws    Input: it holds another array; `where` names it
Samples decode_samples(std::span<const std::byte> bytes, const std::vector<double>& times_s,
                       std::size_t num_channels, const std::string& where);

/// Whether the rows of scans are in order and within the time of their ticks.
bool are_times_of_scans(std::span<const double> times_s, const TickRange& ticks, double rate_hz);

/// NumPy's structured array, a row a measurement: `time_s`, then the channels by their names and types.
/// scans    numbers that their channels' types can hold; a Float32 is rounded
std::vector<std::byte> encode_scans(const Samples& scans, std::span<const StreamChannel> channels);

/// ticks    of which the file holds the scans
/// throws   Input: it is another array, or rows are at other times; `where` names it
Samples decode_scans(std::span<const std::byte> bytes, const TickRange& ticks, double rate_hz,
                     std::span<const StreamChannel> channels, const std::string& where);

}  // namespace terracast::capture
