#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "rigs/imported_sensor.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "rigs/yaml_file.h"

// Calibrations of velodyne_pointcloud, made from Velodyne's db.xml: a list of lasers with angles in radians and offsets in metres, of
// which a laser that is turned by rot_correction to the left looks along its own azimuth and begins beside and above the head's centre,
// across its own beam. Such a beam is here the same line, begun where it passes the head's left-right plane.
// https://github.com/ros-drivers/velodyne
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using core::fail;
namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::size_t kMostLasers = 4096;

constexpr const char* kOfRanges =
    "corrects ranges as they are measured; here they are measured without that error";
constexpr const char* kOfLight = "corrects intensities as they are measured";

constexpr std::array kKnown = {
    core::KnownName{"lasers", "the lasers"},
    core::KnownName{"lasers[].laser_id", "its place in the cycle, and its ring"},
    core::KnownName{"lasers[].vert_correction", "elevation_deg, from radians"},
    core::KnownName{"lasers[].rot_correction", "azimuth_deg, from radians"},
    core::KnownName{"lasers[].vert_offset_correction", "vertical_mm, from m across the beam"},
    core::KnownName{"lasers[].horiz_offset_correction", "across_mm, from m across the beam"},
    core::KnownName{"num_lasers", "their number"},
    core::KnownName{"distance_resolution", "range_step_m"},
    core::KnownName{"lasers[].dist_correction", kOfRanges, false},
    core::KnownName{"lasers[].dist_correction_x", kOfRanges, false},
    core::KnownName{"lasers[].dist_correction_y", kOfRanges, false},
    core::KnownName{"lasers[].two_pt_correction_available", kOfRanges, false},
    core::KnownName{"lasers[].focal_distance", kOfLight, false},
    core::KnownName{"lasers[].focal_slope", kOfLight, false},
    core::KnownName{"lasers[].max_intensity", kOfLight, false},
    core::KnownName{"lasers[].min_intensity", kOfLight, false},
};

double between(const YamlValue& laser, const char* key, double most) {
  if (!laser.states(key)) return 0.0;
  const YamlValue value = laser.at(key);
  const double number = value.number();
  if (!(std::abs(number) <= most))
    fail(ErrorKind::Input, "{} = {}; it lies from {} to {}", value.where(), number, -most, most);
  return number;
}

struct Lasers {
  std::vector<double> elevation_deg, azimuth_deg, vertical_mm, across_mm;

  explicit Lasers(std::size_t count)
      : elevation_deg(count), azimuth_deg(count), vertical_mm(count), across_mm(count) {}

  void set(std::size_t id, const YamlValue& laser) {
    constexpr double kSteepest_rad = 89.0 * kDegree, kMostTurn_rad = 60.0 * kDegree;
    if (!laser.states("vert_correction"))
      fail(ErrorKind::Input, "{} has no vert_correction, its elevation in radians", laser.where());
    const double elevation_rad = between(laser, "vert_correction", kSteepest_rad);
    const double turn_rad = between(laser, "rot_correction", kMostTurn_rad);
    const double up_m = between(laser, "vert_offset_correction", 1.0);
    const double left_m = between(laser, "horiz_offset_correction", 1.0);
    elevation_deg[id] = elevation_rad / kDegree;
    azimuth_deg[id] = turn_rad / kDegree;
    // On along the beam's level part by left tan(turn), and so up by that times tan(elevation).
    across_mm[id] = 1e3 * left_m / std::cos(turn_rad);
    vertical_mm[id] = 1e3 * (up_m / std::cos(elevation_rad) +
                             left_m * std::tan(turn_rad) * std::tan(elevation_rad));
  }
};

std::size_t id_of(const YamlValue& laser, std::size_t count, std::vector<bool>& is_taken) {
  const YamlValue value = laser.at("laser_id");
  const double id = value.number();
  if (!(id >= 0.0 && id < static_cast<double>(count) && id == std::floor(id)))
    fail(ErrorKind::Input, "{} = {}; of {} lasers they are 0 to {}", value.where(), id, count,
         count - 1);
  const auto index = static_cast<std::size_t>(id);
  if (is_taken[index])
    fail(ErrorKind::Input, "{} = {} stands twice; each laser has its own", value.where(), id);
  is_taken[index] = true;
  return index;
}

/// All that a file does not say: 10 turns a second, and when lasers fire. All heads of 16 lasers have the VLP-16's cycle, as its
/// manual states it; others fire together here, 1800 times a turn.
std::string timing_keys(std::size_t num_lasers) {
  constexpr double kCycle_us = 55.296, kStep_us = 2.304;
  if (num_lasers != 16) return "rate_hz = 10.0\ncolumns = 1800\n";
  std::vector<double> firing_us;
  for (std::size_t i = 0; i < num_lasers; ++i)
    firing_us.push_back(kStep_us * static_cast<double>(i));
  return fmt::format("rate_hz = 10.0\ncycle_us = {}\nfiring_us = [{}]\n", kCycle_us,
                     fmt::join(firing_us, ", "));
}

ImportedRig read_velodyne(const fs::path& path, const ReadOptions& options) {
  const YamlValue file = YamlValue::read(path);
  const YamlValue list = file.at("lasers");
  const std::vector<YamlValue> items = list.items();
  if (items.empty() || items.size() > kMostLasers)
    fail(ErrorKind::Input, "{}: {} lasers; a head has 1 to {}", list.where(), items.size(),
         kMostLasers);
  if (file.states("num_lasers") &&
      file.at("num_lasers").number() != static_cast<double>(items.size()))
    file.at("num_lasers")
        .misunderstand(fmt::format("{}, and {} stand in lasers, which count",
                                   file.at("num_lasers").text(), items.size()));
  Lasers lasers(items.size());
  std::vector<bool> is_taken(items.size());
  for (const YamlValue& item : items) lasers.set(id_of(item, items.size(), is_taken), item);
  std::string keys =
      "name = \"lidar\"\nkind = \"lidar\"\npattern = \"spinning\"\n" + timing_keys(items.size());
  const auto add = [&](const char* key, const std::vector<double>& values) {
    keys += fmt::format("{} = [{}]\n", key, fmt::join(values, ", "));
  };
  add("elevation_deg", lasers.elevation_deg);
  add("azimuth_deg", lasers.azimuth_deg);
  add("vertical_mm", lasers.vertical_mm);
  add("across_mm", lasers.across_mm);
  if (file.states("distance_resolution"))
    keys += fmt::format("range_step_m = {}\n", between(file, "distance_resolution", 1.0));
  ImportedRig read;
  read.rig.name = options.name.empty() ? safe_name(path.stem().string()) : options.name;
  read.rig.sensors.push_back(sensor_of_keys(list.where(), keys, {}));
  read.ledger = file.ledger(kKnown);
  return read;
}

}  // namespace

RigFormatInfo velodyne_rigs() {
  return {.name = "velodyne",
          .summary = "A calibration of velodyne_pointcloud (YAML): a Velodyne's lasers. Read only.",
          .is_of_sensors = true,
          .recognises =
              [](const fs::path& path, std::string_view) {
                const auto file = yaml_map_of(path);
                return file != nullptr && file->has("lasers") && file->has("num_lasers");
              },
          .read = read_velodyne,
          .known =
              [] {
                return std::vector<core::KnownTable>{
                    {"velodyne", "keys of a file and of a laser", kKnown}};
              }};
}

}  // namespace terracast::rigs
