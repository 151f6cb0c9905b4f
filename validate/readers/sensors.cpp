#include "validate/readers/sensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/printable.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

/// What a clock showed: the last column where a sensor has one of its own.
constexpr const char* kStamp = "stamp_s";

/// Of an IMU: what it shows, and its truth.
constexpr std::size_t kNumReadings = 12;

Pose read_mount(const Json& json, const std::string& where) {
  const std::vector<double> q = json.at("quaternion_wxyz").numbers();
  const std::vector<double> t = json.at("translation_m").numbers();
  if (q.size() != 4 || t.size() != 3)
    fail(ErrorKind::Input, "{}: a mount of {} and {} numbers, not 4 and 3", where, q.size(),
         t.size());
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  constexpr double kUnitLength = 1e-9;
  if (!(std::abs(rotation.norm() - 1.0) <= kUnitLength))
    fail(ErrorKind::Input, "{}: a quaternion of length {}, not 1", where, rotation.norm());
  return {rotation.toRotationMatrix(), {t[0], t[1], t[2]}};
}

struct ChannelName {
  std::string name, unit;
};
/// Channels of what is shown, others, and those of the truth, which are called as those that are shown.
std::vector<ChannelName> with_truth(const std::vector<ChannelName>& shown,
                                    const std::vector<ChannelName>& others = {}) {
  std::vector<ChannelName> channels = shown;
  channels.insert(channels.end(), others.begin(), others.end());
  for (const ChannelName& channel : shown)
    channels.push_back({"true_" + channel.name, channel.unit});
  return channels;
}

/// Names and units of an IMU's channels: turn rate and specific force that it shows, their truth, its pose and velocity in
/// the Earth's axes, its biases.
std::vector<ChannelName> channels_of_imu() {
  std::vector<ChannelName> channels;
  const auto add = [&](const std::string& start, const std::string& axes, const std::string& end,
                       const std::string& unit) {
    for (const char axis : axes) channels.push_back({start + axis + end, unit});
  };
  for (const std::string what : {"", "true_"}) {
    add(what + "gyro_", "xyz", "_radps", "rad/s");
    add(what + "accel_", "xyz", "_mps2", "m/s^2");
  }
  add("ecef_", "xyz", "_m", "m");
  add("ecef_q", "wxyz", "", "");
  add("ecef_v", "xyz", "_mps", "m/s");
  add("gyro_bias_", "xyz", "_radps", "rad/s");
  add("accel_bias_", "xyz", "_mps2", "m/s^2");
  return channels;
}

/// The channels that kinds have; those of plug-ins are called, and measured in, what they like.
const std::map<std::string, std::vector<ChannelName>>& channels_of_kinds() {
  static const std::map<std::string, std::vector<ChannelName>> kChannels = {
      {"airspeed",
       {{"differential_pressure_pa", "Pa"},
        {"indicated_airspeed_mps", "m/s"},
        {"true_differential_pressure_pa", "Pa"},
        {"true_airspeed_mps", "m/s"},
        {"true_wind_east_mps", "m/s"},
        {"true_wind_north_mps", "m/s"},
        {"true_wind_up_mps", "m/s"}}},
      {"barometer",
       {{"pressure_pa", "Pa"}, {"true_pressure_pa", "Pa"}, {"true_altitude_msl_m", "m"}}},
      {"gnss", with_truth({{"lat_deg", "deg"},
                           {"lon_deg", "deg"},
                           {"height_m", "m"},
                           {"altitude_msl_m", "m"},
                           {"velocity_north_mps", "m/s"},
                           {"velocity_east_mps", "m/s"},
                           {"velocity_down_mps", "m/s"}},
                          {{"sigma_horizontal_m", "m"},
                           {"sigma_vertical_m", "m"},
                           {"sigma_velocity_horizontal_mps", "m/s"},
                           {"sigma_velocity_vertical_mps", "m/s"},
                           {"fix", ""}})},
      {"imu", channels_of_imu()},
      {"magnetometer",
       with_truth({{"field_x_nt", "nT"}, {"field_y_nt", "nT"}, {"field_z_nt", "nT"}})},
      {"radar_altimeter", with_truth({{"range_m", "m"}})},
      {"rangefinder", {{"range_m", "m"}}}};
  return kChannels;
}

/// A column of a scanner.
struct ScanColumn {
  std::string_view name;
  std::string_view type;  ///< kind and bytes of its numbers
};
/// In order, after the time.
constexpr std::array<ScanColumn, 21> kLidarColumns = {{{"x_m", "f8"},
                                                       {"y_m", "f8"},
                                                       {"z_m", "f8"},
                                                       {"range_m", "f8"},
                                                       {"true_range_m", "f8"},
                                                       {"spread_m", "f4"},
                                                       {"power_per_m2", "f4"},
                                                       {"reflectance", "f4"},
                                                       {"incidence_rad", "f4"},
                                                       {"ring", "u2"},
                                                       {"pulse", "u4"},
                                                       {"return_number", "u1"},
                                                       {"num_returns", "u1"},
                                                       {"class_id", "u1"},
                                                       {"instance_id", "u4"},
                                                       {"local_x_m", "f8"},
                                                       {"local_y_m", "f8"},
                                                       {"local_z_m", "f8"},
                                                       {"local_origin_x_m", "f8"},
                                                       {"local_origin_y_m", "f8"},
                                                       {"local_origin_z_m", "f8"}}};
constexpr std::array<ScanColumn, 23> kGnssColumns = {{{"prn", "u1"},
                                                      {"azimuth_deg", "f8"},
                                                      {"elevation_deg", "f8"},
                                                      {"is_visible", "u1"},
                                                      {"blocked_by_class_id", "u1"},
                                                      {"blocked_by_instance_id", "u4"},
                                                      {"pseudorange_m", "f8"},
                                                      {"carrier_cycles", "f8"},
                                                      {"doppler_hz", "f8"},
                                                      {"true_range_m", "f8"},
                                                      {"true_range_rate_mps", "f8"},
                                                      {"receiver_clock_s", "f8"},
                                                      {"satellite_clock_s", "f8"},
                                                      {"ionosphere_m", "f8"},
                                                      {"troposphere_m", "f8"},
                                                      {"satellite_x_ecef_m", "f8"},
                                                      {"satellite_y_ecef_m", "f8"},
                                                      {"satellite_z_ecef_m", "f8"},
                                                      {"num_visible", "u1"},
                                                      {"hdop", "f4"},
                                                      {"vdop", "f4"},
                                                      {"pdop", "f4"},
                                                      {"tdop", "f4"}}};
constexpr std::array<ScanColumn, 5> kEventColumns = {
    {{"x_px", "u2"}, {"y_px", "u2"}, {"polarity", "u1"}, {"is_noise", "u1"}, {"contrast", "f4"}}};

/// The columns of a kind's scans; empty: it is no scanner, or a plug-in's.
std::span<const ScanColumn> columns_of_scanner(std::string_view kind) {
  if (kind == "lidar") return kLidarColumns;
  if (kind == "events") return kEventColumns;
  if (kind == "gnss_observations") return kGnssColumns;
  return {};
}

/// count   of its channels, without stamps
void check_channels_of_scanner(const std::string& kind, const Json& channels, std::size_t count,
                               const std::string& where) {
  const std::span<const ScanColumn> columns = columns_of_scanner(kind);
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (count != columns.size() || channels.at(i).at("name").string() != columns[i].name)
      fail(ErrorKind::Input, "{}: channel {} of a sensor of the kind {} is {}", where, i, kind,
           columns[i].name);
}

void check_channels(const std::string& kind, const Json& channels, std::size_t count,
                    const std::string& where) {
  if (!columns_of_scanner(kind).empty())
    return check_channels_of_scanner(kind, channels, count, where);
  const auto known = channels_of_kinds().find(kind);
  if (known == channels_of_kinds().end()) return;
  const std::vector<ChannelName>& right = known->second;
  // An earlier version's IMU has its readings alone.
  const bool is_early_imu = kind == "imu" && count == kNumReadings;
  if (count != right.size() && !is_early_imu)
    fail(ErrorKind::Input, "{}: {} channels; a {} has {}, from {} on", where, count, kind,
         right.size(), right[0].name);
  for (std::size_t i = 0; i < count; ++i)
    if (channels.at(i).at("name").string() != right[i].name ||
        channels.at(i).at("unit").string() != right[i].unit)
      fail(ErrorKind::Input, "{}: channel {} of a {} is {} in {}", where, i, kind, right[i].name,
           right[i].unit.empty() ? "no unit" : right[i].unit);
}

/// A number, or an infinite one.
double parse_sample(std::string_view cell, const std::string& where) {
  if (cell == "inf") return std::numeric_limits<double>::infinity();
  if (cell == "-inf") return -std::numeric_limits<double>::infinity();
  return parse_number(cell, where);
}

void read_samples(const Dataset& dataset, const std::string& header, SensorRecord& sensor) {
  const std::string text = core::read_text_file(dataset.root / sensor.file);
  const std::vector<TextLine> lines = split_lines(text);
  if (lines.empty() || lines[0].text != header)
    fail(ErrorKind::Input, "{}:1: another header than {}", sensor.file, header);
  // Ranges end in the sky, and plug-ins may show what they like.
  const bool is_finite = !measures_ranges(sensor) && channels_of_kinds().contains(sensor.kind);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::string where = sensor.file + ":" + std::to_string(lines[i].number);
    const std::vector<std::string_view> cells = split_at(lines[i].text, ',');
    const std::size_t num_columns = 1 + sensor.num_channels;
    if (cells.size() != num_columns + (sensor.clock ? 1 : 0))
      fail(ErrorKind::Input, "{}: {} columns, not {}", where, cells.size(),
           num_columns + (sensor.clock ? 1 : 0));
    sensor.times_s.push_back(parse_number(cells[0], where));
    if (sensor.clock) sensor.stamps_s.push_back(parse_number(cells.back(), where));
    for (std::size_t k = 1; k < num_columns; ++k)
      sensor.values.push_back(is_finite ? parse_number(cells[k], where)
                                        : parse_sample(cells[k], where));
  }
}

/// The text behind `key = ` in a text of TOML.
std::string words_of(const std::string& toml, const std::string& key, const std::string& where) {
  for (const TextLine& line : split_lines(toml)) {
    const std::size_t equals = line.text.find('=');
    if (equals != std::string_view::npos && trimmed(line.text.substr(0, equals)) == key)
      return std::string(trimmed(line.text.substr(equals + 1)));
  }
  fail(ErrorKind::Input, "{}: settings_toml has no {}", where, key);
}
double setting_of(const std::string& toml, const std::string& key, const std::string& where) {
  return parse_number(words_of(toml, key, where), where);
}

/// Of a list of numbers in one line, "[1.0, 2.0]".
std::vector<double> settings_of(const std::string& toml, const std::string& key,
                                const std::string& where) {
  const std::string words = words_of(toml, key, where);
  if (words.size() < 2 || words.front() != '[' || words.back() != ']')
    fail(ErrorKind::Input, "{}: {} of settings_toml is no list", where, key);
  std::vector<double> numbers;
  const std::string_view inside = std::string_view(words).substr(1, words.size() - 2);
  for (const std::string_view cell : split_at(inside, ','))
    if (!trimmed(cell).empty()) numbers.push_back(parse_number(trimmed(cell), where));
  return numbers;
}

void read_settings_of_lidar(const std::string& toml, const std::string& where,
                            SensorRecord& sensor) {
  sensor.num_rays = static_cast<std::int64_t>(setting_of(toml, "rays", where));
  sensor.range_noise_m = setting_of(toml, "range_noise_m", where);
  sensor.range_step_m = setting_of(toml, "range_step_m", where);
  if (words_of(toml, "pattern", where) != "\"spinning\"") return;
  sensor.elevations_deg = settings_of(toml, "elevation_deg", where);
  double within_mm = std::abs(setting_of(toml, "origin_mm", where));
  for (const char* key : {"vertical_mm", "across_mm"}) {
    double most_mm = 0.0;
    for (const double off_mm : settings_of(toml, key, where))
      most_mm = std::max(most_mm, std::abs(off_mm));
    within_mm += most_mm;
  }
  sensor.beams_within_m = 1e-3 * within_mm;
}

bool is_integrated(const std::string& toml, const std::string& where) {
  const std::string sampling = words_of(toml, "sampling", where);
  if (sampling != "\"instant\"" && sampling != "\"integrated\"")
    fail(ErrorKind::Input, "{}: settings_toml samples {}, not \"instant\" or \"integrated\"", where,
         core::first_letters(sampling, 40));
  return sampling == "\"integrated\"";
}

SensorClock read_clock(const Json& json, const std::string& where) {
  const Json& believed = json.at("believed");
  SensorClock clock{.offset_s = json.at("offset_s").number(),
                    .drift = json.at("drift").number(),
                    .jitter_sd_s = json.at("jitter_sd_s").number(),
                    .believed_offset_s = believed.at("offset_s").number(),
                    .believed_drift = believed.at("drift").number()};
  for (const double number : {clock.offset_s, clock.drift, clock.jitter_sd_s,
                              clock.believed_offset_s, clock.believed_drift})
    if (!std::isfinite(number)) fail(ErrorKind::Input, "{}: its clock has a {}", where, number);
  if (!(clock.jitter_sd_s >= 0.0) || !(clock.drift > -1.0))
    fail(ErrorKind::Input, "{}: a clock that gains {} s a second and jitters by {} s", where,
         clock.drift, clock.jitter_sd_s);
  return clock;
}

SensorRecord read_sensor(const Dataset& dataset, const Sequence& sequence, const Json& json,
                         const std::string& path) {
  SensorRecord sensor;
  sensor.rig = json.at("rig").string();
  sensor.name = json.at("name").string();
  sensor.kind = json.at("kind").string();
  const std::string where = fmt::format("{}: {}", path, core::first_letters(sensor.name, 60));
  // Those of plug-ins have a dot.
  const bool is_scanner = !columns_of_scanner(sensor.kind).empty();
  if (!channels_of_kinds().contains(sensor.kind) && !is_scanner &&
      sensor.kind.find('.') == std::string::npos)
    fail(ErrorKind::Input, "{}: no sensor is of the kind {}", where,
         core::first_letters(sensor.kind, 60));
  sensor.is_scan = json.has("folder");
  const std::string file = json.at(sensor.is_scan ? "folder" : "file").string();
  if (file != fmt::format("sensors/{}/{}{}", sensor.rig, sensor.name, sensor.is_scan ? "" : ".csv"))
    fail(ErrorKind::Input, "{}: its file is {}; sensors/RIG/NAME{} is right", where,
         core::first_letters(file, 100), sensor.is_scan ? "" : ".csv");
  if (is_scanner != sensor.is_scan && sensor.kind.find('.') == std::string::npos)
    fail(ErrorKind::Input, "{}: a {} has {}", where, sensor.kind,
         is_scanner ? "a folder of scans" : "a file");
  sensor.file = sequence.path + "/" + file;
  if (!sensor.is_scan && !dataset.files.contains(sensor.file))
    fail(ErrorKind::Input, "{}: {} is not in dataset.json", where, sensor.file);
  sensor.rate_hz = json.at("rate_hz").number();
  if (!(sensor.rate_hz > 0.0)) fail(ErrorKind::Input, "{}: rate_hz = {}", where, sensor.rate_hz);
  sensor.body_from_sensor = read_mount(json.at("body_from_sensor"), where);
  sensor.rig_from_sensor = read_mount(json.at("rig_from_sensor"), where);
  std::string header = "time_s";
  const Json& channels = json.at("channels");
  if (!channels.is_array()) fail(ErrorKind::Input, "{}: channels are no list", where);
  if (json.has("clock")) sensor.clock = read_clock(json.at("clock"), where);
  const std::size_t num_stamps = sensor.clock ? 1 : 0;
  if (sensor.clock &&
      (channels.size() == 0 || channels.at(channels.size() - 1).at("name").string() != kStamp ||
       channels.at(channels.size() - 1).at("unit").string() != "s"))
    fail(ErrorKind::Input, "{}: it has a clock, but its last channel is not {} in s", where,
         kStamp);
  sensor.num_channels = channels.size() - num_stamps;
  check_channels(sensor.kind, channels, sensor.num_channels, where);
  for (std::size_t i = 0; i < sensor.num_channels; ++i) {
    sensor.channels.push_back(channels.at(i).at("name").string());
    header += "," + sensor.channels.back();
  }
  if (sensor.clock) header += fmt::format(",{}", kStamp);
  sensor.settings_toml = json.at("settings_toml").string();
  if (measures_ranges(sensor) || sensor.kind == "lidar") {
    sensor.least_range_m = setting_of(sensor.settings_toml, "least_range_m", where);
    sensor.most_range_m = setting_of(sensor.settings_toml, "most_range_m", where);
  }
  if (sensor.kind == "barometer") {
    sensor.sea_level_pressure_pa = setting_of(sensor.settings_toml, "sea_level_pressure_pa", where);
    sensor.warmer_k = setting_of(sensor.settings_toml, "warmer_k", where);
  }
  if (sensor.kind == "imu") sensor.is_integrated = is_integrated(sensor.settings_toml, where);
  if (sensor.kind == "lidar") read_settings_of_lidar(sensor.settings_toml, where, sensor);
  if (sensor.kind == "gnss_observations")
    sensor.gnss = {
        .mask_deg = setting_of(sensor.settings_toml, "mask_deg", where),
        .plants_pass = words_of(sensor.settings_toml, "plants", where) == "\"pass\"",
        .has_ionosphere = words_of(sensor.settings_toml, "ionosphere", where) != "\"none\"",
        .has_troposphere = words_of(sensor.settings_toml, "troposphere", where) != "\"none\"",
        .clock_offset_us = setting_of(sensor.settings_toml, "clock_offset_us", where),
        .clock_drift_ppb = setting_of(sensor.settings_toml, "clock_drift_ppb", where),
        .pseudorange_noise_m = setting_of(sensor.settings_toml, "pseudorange_noise_m", where),
        .carrier_noise_mm = setting_of(sensor.settings_toml, "carrier_noise_mm", where),
        .doppler_noise_hz = setting_of(sensor.settings_toml, "doppler_noise_hz", where)};
  if (!sensor.is_scan) read_samples(dataset, header, sensor);
  return sensor;
}

}  // namespace

EventSettings event_settings(const SensorRecord& sensor) {
  const auto number = [&](const char* key) {
    return setting_of(sensor.settings_toml, key, sensor.file);
  };
  const auto size_px = [&](const char* key) {
    constexpr double kMost = 16384.0;
    const double size = number(key);
    if (!(size >= 0.0 && size <= kMost && size == std::floor(size)))
      fail(ErrorKind::Input, "{}: {} of settings_toml is {}, no size", sensor.file, key, size);
    return static_cast<int>(size);
  };
  const std::string camera = words_of(sensor.settings_toml, "camera", sensor.file);
  if (camera.size() < 2 || camera.front() != '"' || camera.back() != '"')
    fail(ErrorKind::Input, "{}: camera of settings_toml is no text", sensor.file);
  return {.camera = camera.substr(1, camera.size() - 2),
          .width_px = size_px("width_px"),
          .height_px = size_px("height_px"),
          .contrast_on = number("contrast_on"),
          .contrast_off = number("contrast_off"),
          .contrast_sd = number("contrast_sd"),
          .refractory_us = number("refractory_us"),
          .are_changes_lost =
              words_of(sensor.settings_toml, "in_refractory", sensor.file) != "\"kept\"",
          .cutoff_hz = number("cutoff_hz"),
          .cutoff_least_share = number("cutoff_least_share"),
          .leak_hz = number("leak_hz"),
          .dark_cd_per_m2 = number("dark_cd_per_m2")};
}

NpyTable read_scans(const Dataset& dataset, const SensorRecord& scanner, int frame) {
  const std::string path = fmt::format("{}/{:06}.npy", scanner.file, frame);
  if (!dataset.files.contains(path))
    fail(ErrorKind::Input, "{}: frame {}'s scans are missing", path, frame);
  NpyTable table = parse_npy_table(core::read_file(dataset.root / path), path);
  bool are_same =
      table.columns.size() == scanner.channels.size() + (scanner.clock ? 2 : 1) &&
      table.columns.front().name == "time_s" &&
      (!scanner.clock || (table.columns.back().name == kStamp && table.columns.back().kind == 'f' &&
                          table.columns.back().item_size == 8));
  for (std::size_t k = 0; are_same && k < scanner.channels.size(); ++k)
    are_same = table.columns[k + 1].name == scanner.channels[k];
  if (!are_same)
    fail(ErrorKind::Input, "{}: other columns than time_s and those of sensors.json", path);
  const std::span<const ScanColumn> columns = columns_of_scanner(scanner.kind);
  for (std::size_t k = 0; !columns.empty() && k <= columns.size(); ++k) {
    const std::string_view right = k == 0 ? "f8" : columns[k - 1].type;
    const NpyTable::Column& column = table.columns[k];
    if (column.kind != right[0] || column.item_size != static_cast<std::size_t>(right[1] - '0'))
      fail(ErrorKind::Input, "{}: column {} is of type {}{}, not {}", path, column.name,
           column.kind, column.item_size, right);
  }
  if (scanner.change_scans) scanner.change_scans(table, frame);
  return table;
}

bool measures_ranges(const SensorRecord& sensor) {
  return sensor.kind == "rangefinder" || sensor.kind == "radar_altimeter";
}

std::optional<ImuState> SensorRecord::imu_state(std::size_t sample) const {
  if (kind != "imu" || num_channels == kNumReadings) return std::nullopt;
  const double* row = &values[sample * num_channels + kNumReadings];
  const auto three = [row](std::size_t first) {
    return Eigen::Vector3d(row[first], row[first + 1], row[first + 2]);
  };
  return ImuState{
      .ecef_from_sensor = {Eigen::Quaterniond(row[3], row[4], row[5], row[6]).toRotationMatrix(),
                           three(0)},
      .velocity_ecef_mps = three(7),
      .gyro_bias_radps = three(10),
      .accel_bias_mps2 = three(13)};
}

std::vector<SensorRecord> read_sensors(const Dataset& dataset, const Sequence& sequence) {
  if (sequence.tried_sensors) return *sequence.tried_sensors;
  const std::string path = sequence.path + "/sensors.json";
  if (!dataset.files.contains(path)) return {};
  const Json json = Json::read(dataset.root / path);
  if (json.at("frames").string() != "body, rig and sensor: x forward, y left, z up")
    fail(ErrorKind::Input, "{}: frames of other axes than x forward, y left, z up", path);
  std::vector<SensorRecord> sensors;
  for (std::size_t i = 0; i < json.at("sensors").size(); ++i)
    sensors.push_back(read_sensor(dataset, sequence, json.at("sensors").at(i), path));
  return sensors;
}

}  // namespace terracast::validate
