#include "capture/stream.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/npy.h"
#include "core/printable.h"

namespace terracast::capture {
namespace {

/// The first tick that is no earlier than a time.
std::int64_t first_tick_from(double rate_hz, double time_s) {
  auto tick = static_cast<std::int64_t>(std::floor(time_s * rate_hz)) - 1;
  while (static_cast<double>(tick) / rate_hz < time_s) ++tick;
  return std::max<std::int64_t>(tick, 0);
}

bool is_channel_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && name.front() >= 'a' && name.front() <= 'z' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
         });
}

bool is_unit(std::string_view unit) {
  return unit.size() <= 32 && core::printable(unit) == unit &&
         unit.find_first_of(",;\"'\\") == std::string_view::npos;
}

}  // namespace

std::string wrong_channels(std::span<const StreamChannel> channels) {
  if (channels.empty() || channels.size() > kMaxStreamChannels)
    return fmt::format("has {} channels; it takes 1 to {}", channels.size(), kMaxStreamChannels);
  std::set<std::string_view> names{"time_s"};
  for (const StreamChannel& channel : channels) {
    const std::string_view name = core::first_letters(channel.name, 100);
    if (!is_channel_name(channel.name))
      return fmt::format(
          "has a channel \"{}\"; a name is of a to z, 0 to 9 and _, begins with a letter, and has "
          "64 "
          "at most",
          name);
    if (!names.insert(channel.name).second)
      return fmt::format("has the channel \"{}\" {}", name,
                         name == "time_s" ? "beside the time, which has this name" : "twice");
    if (!is_unit(channel.unit))
      return fmt::format(
          "has a channel {} in \"{}\"; a unit is of 32 bytes at most, without control "
          "characters, commas, semicolons, quotes and backslashes",
          name, core::first_letters(channel.unit, 100));
  }
  return {};
}

TickRange ticks_of_frame(double rate_hz, double frame_rate_hz, int frame, int num_frames) {
  const double time_s = frame / frame_rate_hz;
  const std::int64_t first = first_tick_from(rate_hz, time_s);
  if (frame + 1 < num_frames)
    return {.first = first, .end = first_tick_from(rate_hz, (frame + 1) / frame_rate_hz)};
  const bool is_at_frame = static_cast<double>(first) / rate_hz == time_s;
  return {.first = first, .end = first + (is_at_frame ? 1 : 0)};
}

std::vector<double> times_of(const TickRange& ticks, double rate_hz) {
  std::vector<double> times_s;
  for (std::int64_t tick = ticks.first; tick < ticks.end; ++tick)
    times_s.push_back(static_cast<double>(tick) / rate_hz);
  return times_s;
}

std::vector<std::byte> encode_samples(const Samples& samples, std::size_t num_channels) {
  TERRACAST_CHECK(samples.values.size() == samples.times_s.size() * num_channels,
                  "{} values of {} samples of {} channels", samples.values.size(),
                  samples.times_s.size(), num_channels);
  std::vector<double> rows;
  rows.reserve(samples.values.size() + samples.times_s.size());
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    rows.push_back(samples.times_s[i]);
    for (std::size_t k = 0; k < num_channels; ++k)
      rows.push_back(samples.values[i * num_channels + k]);
  }
  return core::npy_bytes(std::span<const double>(rows), {static_cast<int>(samples.times_s.size()),
                                                         static_cast<int>(num_channels) + 1});
}

Samples decode_samples(std::span<const std::byte> bytes, const std::vector<double>& times_s,
                       std::size_t num_channels, const std::string& where) {
  const std::size_t num_columns = num_channels + 1;
  const std::size_t num_bytes = times_s.size() * num_columns * sizeof(double);
  Samples samples{.times_s = times_s, .values = {}};
  if (bytes.size() >= num_bytes) {
    std::vector<double> rows(times_s.size() * num_columns);
    if (num_bytes > 0)
      std::memcpy(rows.data(), bytes.data() + (bytes.size() - num_bytes), num_bytes);
    bool are_times = true;
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      are_times = are_times && rows[i * num_columns] == times_s[i];
      for (std::size_t k = 1; k < num_columns; ++k)
        samples.values.push_back(rows[i * num_columns + k]);
    }
    // The header is known to the byte.
    const std::vector<std::byte> expected = encode_samples(samples, num_channels);
    if (are_times && std::equal(bytes.begin(), bytes.end(), expected.begin(), expected.end()))
      return samples;
  }
  core::fail(core::ErrorKind::Input,
             "{}: not the NumPy array of {} x {} doubles that holds the stream's samples from "
             "{:.6f} s on; render the sequence again",
             where, times_s.size(), num_columns, times_s.empty() ? 0.0 : times_s.front());
}

}  // namespace terracast::capture
