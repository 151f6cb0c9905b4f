#include "capture/stream.h"

#include <algorithm>
#include <array>
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

/// NumPy's name of a type, by NumberType; it ends with its bytes.
constexpr std::array<std::string_view, 5> kNumpyTypes = {"<f8", "<f4", "<u4", "<u2", "|u1"};

std::string_view numpy_type(const StreamChannel& channel) {
  return kNumpyTypes.at(static_cast<std::size_t>(channel.type));
}
std::size_t bytes_of(const StreamChannel& channel) {
  return static_cast<std::size_t>(numpy_type(channel).back() - '0');
}

/// The time, and after it the channels.
std::vector<StreamChannel> columns_of(std::span<const StreamChannel> channels) {
  std::vector<StreamChannel> columns = {{.name = "time_s", .unit = "s"}};
  columns.insert(columns.end(), channels.begin(), channels.end());
  return columns;
}

template <class Number>
void put_number(double value, std::byte* at) {
  const auto number = static_cast<Number>(value);
  std::memcpy(at, &number, sizeof(Number));
}
template <class Number>
double number_at(const std::byte* at) {
  Number number;
  std::memcpy(&number, at, sizeof(Number));
  return static_cast<double>(number);
}

void put(const StreamChannel& channel, double value, std::byte* at) {
  if (channel.type == NumberType::Float64) return put_number<double>(value, at);
  if (channel.type == NumberType::Float32) return put_number<float>(value, at);
  const double most = std::ldexp(1.0, 8 * static_cast<int>(bytes_of(channel))) - 1.0;
  TERRACAST_CHECK(value >= 0.0 && value <= most && value == std::floor(value),
                  "{} of a scan is {}, which is no count up to {}", channel.name, value, most);
  if (channel.type == NumberType::Count32) return put_number<std::uint32_t>(value, at);
  if (channel.type == NumberType::Count16) return put_number<std::uint16_t>(value, at);
  put_number<std::uint8_t>(value, at);
}
double value_at(const StreamChannel& channel, const std::byte* at) {
  switch (channel.type) {
    case NumberType::Float64:
      return number_at<double>(at);
    case NumberType::Float32:
      return number_at<float>(at);
    case NumberType::Count32:
      return number_at<std::uint32_t>(at);
    case NumberType::Count16:
      return number_at<std::uint16_t>(at);
    case NumberType::Count8:
      break;
  }
  return number_at<std::uint8_t>(at);
}

std::vector<std::byte> table_of(std::span<const StreamChannel> columns, std::size_t num_rows,
                                std::span<const std::byte> rows) {
  std::vector<core::NpyField> fields;
  for (const StreamChannel& column : columns)
    fields.push_back({.name = column.name, .type = numpy_type(column)});
  return core::npy_table_bytes(fields, num_rows, rows);
}

std::size_t row_bytes_of(std::span<const StreamChannel> columns) {
  std::size_t bytes = 0;
  for (const StreamChannel& column : columns) bytes += bytes_of(column);
  return bytes;
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

bool are_times_of_scans(std::span<const double> times_s, const TickRange& ticks, double rate_hz) {
  if (times_s.empty()) return true;
  return std::is_sorted(times_s.begin(), times_s.end()) &&
         times_s.front() >= static_cast<double>(ticks.first) / rate_hz &&
         times_s.back() < static_cast<double>(ticks.end) / rate_hz;
}

std::vector<std::byte> encode_scans(const Samples& scans, std::span<const StreamChannel> channels) {
  const std::size_t num_rows = scans.times_s.size();
  TERRACAST_CHECK(scans.values.size() == num_rows * channels.size(),
                  "{} values of {} rows of {} channels", scans.values.size(), num_rows,
                  channels.size());
  const std::vector<StreamChannel> columns = columns_of(channels);
  std::vector<std::byte> rows(num_rows * row_bytes_of(columns));
  std::byte* at = rows.data();
  for (std::size_t i = 0; i < num_rows; ++i)
    for (std::size_t k = 0; k < columns.size(); ++k) {
      put(columns[k], k == 0 ? scans.times_s[i] : scans.values[i * channels.size() + k - 1], at);
      at += bytes_of(columns[k]);
    }
  return table_of(columns, num_rows, rows);
}

Samples decode_scans(std::span<const std::byte> bytes, const TickRange& ticks, double rate_hz,
                     std::span<const StreamChannel> channels, const std::string& where) {
  const std::vector<StreamChannel> columns = columns_of(channels);
  const std::size_t row_bytes = row_bytes_of(columns);
  constexpr std::size_t kStart = 10;  // magic, version, and the length of what follows
  if (bytes.size() >= kStart) {
    const std::size_t header_bytes = kStart + std::to_integer<std::size_t>(bytes[8]) +
                                     256 * std::to_integer<std::size_t>(bytes[9]);
    const std::size_t num_rows =
        bytes.size() > header_bytes ? (bytes.size() - header_bytes) / row_bytes : 0;
    const std::span<const std::byte> rows = bytes.last(num_rows * row_bytes);
    // The header is known to the byte.
    const std::vector<std::byte> expected = table_of(columns, num_rows, rows);
    if (std::equal(bytes.begin(), bytes.end(), expected.begin(), expected.end())) {
      Samples scans;
      const std::byte* at = rows.data();
      for (std::size_t i = 0; i < num_rows; ++i)
        for (std::size_t k = 0; k < columns.size(); ++k) {
          (k == 0 ? scans.times_s : scans.values).push_back(value_at(columns[k], at));
          at += bytes_of(columns[k]);
        }
      if (are_times_of_scans(scans.times_s, ticks, rate_hz)) return scans;
    }
  }
  core::fail(core::ErrorKind::Input,
             "{}: not the NumPy array of the scans {} to {}, {} numbers a row; render the sequence "
             "again",
             where, ticks.first, ticks.end - 1, columns.size());
}

}  // namespace terracast::capture
