#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <set>

#include "core/error.h"
#include "rigs/imported_sensor.h"
#include "rigs/json_value.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"

// The objects of CARLA's ROS bridge (objects.json of carla_spawn_objects): the sensors of the first vehicle that has a camera, with
// CARLA's blueprint attributes beside them; what an attribute is without is CARLA's own default. Poses are of ROS: x forward, y
// left, z up, degrees. Noise of CARLA's IMU is a sample's deviation, and its GNSS errs in degrees.
// https://carla.readthedocs.io/en/latest/ref_sensors, https://github.com/carla-simulator/ros-bridge
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using core::fail;
namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = std::size_t{1} << 22;
constexpr std::size_t kMostSensors = 1000;
constexpr double kDegree = std::numbers::pi / 180.0;
/// Between samples of what has no sensor_tick: a step of the simulation, which the bridge sets to this.
constexpr double kStep_s = 0.05;

constexpr const char* kCovered =
    "an image of a camera that another one here is: every camera has color, depth, classes, "
    "normals and flow";

constexpr const char* kOfImages = "how CARLA makes its image; imaging says it here";

constexpr std::array kKnown = {
    core::KnownName{"objects", "vehicles with their sensors"},
    core::KnownName{"objects[].type", "vehicle.…"},
    core::KnownName{"objects[].id", "the rig's name"},
    core::KnownName{"objects[].objects", "the vehicle's sensors"},
    core::KnownName{"objects[].objects[].type",
                    "what sensor it is: sensor.camera, sensor.lidar, sensor.other.imu, "
                    "sensor.other.gnss; others are told"},
    core::KnownName{"objects[].objects[].id", "its name"},
    core::KnownName{"objects[].objects[].spawn_point", "where it stands on the vehicle"},
    core::KnownName{"objects[].objects[].spawn_point.x", "forward, m"},
    core::KnownName{"objects[].objects[].spawn_point.y", "to the left, m"},
    core::KnownName{"objects[].objects[].spawn_point.z", "up, m"},
    core::KnownName{"objects[].objects[].spawn_point.roll", "about forward, degrees"},
    core::KnownName{"objects[].objects[].spawn_point.pitch", "down, degrees"},
    core::KnownName{"objects[].objects[].spawn_point.yaw", "to the left, degrees"},
    core::KnownName{"objects[].objects[].sensor_tick",
                    "time between samples, s; without it 0.05, the bridge's step"},
    core::KnownName{"objects[].objects[].image_size_x", "width in pixels"},
    core::KnownName{"objects[].objects[].image_size_y", "height in pixels"},
    core::KnownName{"objects[].objects[].fov", "of a camera from left to right, degrees"},
    core::KnownName{"objects[].objects[].channels", "lasers of a lidar"},
    core::KnownName{"objects[].objects[].range", "of a lidar, m"},
    core::KnownName{"objects[].objects[].points_per_second", "of a lidar: columns a turn"},
    core::KnownName{"objects[].objects[].rotation_frequency", "turns of a lidar, Hz"},
    core::KnownName{"objects[].objects[].upper_fov", "its highest laser, degrees"},
    core::KnownName{"objects[].objects[].lower_fov", "its lowest laser, degrees"},
    core::KnownName{"objects[].objects[].atmosphere_attenuation_rate",
                    "a lidar's light is exp(-it range): half of it a way, extinction_per_km"},
    core::KnownName{"objects[].objects[].noise_stddev", "of a lidar's ranges, m"},
    core::KnownName{"objects[].objects[].noise_accel_stddev_*", "of an IMU's sample, m/s^2"},
    core::KnownName{"objects[].objects[].noise_gyro_stddev_*", "of an IMU's sample, rad/s"},
    core::KnownName{"objects[].objects[].noise_lat_stddev", "of a GNSS fix, degrees"},
    core::KnownName{"objects[].objects[].noise_lon_stddev", "of a GNSS fix, degrees"},
    core::KnownName{"objects[].objects[].noise_alt_stddev", "of a GNSS fix, m"},
    core::KnownName{"objects[].objects[].noise_gyro_bias_*", "0: none, as biases are drawn here"},
    core::KnownName{"objects[].objects[].noise_lat_bias", "0: none, as errors are drawn here"},
    core::KnownName{"objects[].objects[].noise_lon_bias", "0: none, as errors are drawn here"},
    core::KnownName{"objects[].objects[].noise_alt_bias", "0: none, as errors are drawn here"},
    core::KnownName{"objects[].objects[].horizontal_fov", "360: a lidar's whole turn"},
    core::KnownName{"objects[].objects[].dropoff_*",
                    "range_at_10_percent_m says which echoes are lost, by physics", false},
    core::KnownName{"objects[].objects[].noise_seed", "the job's seed draws noise", false},
    core::KnownName{"objects[].objects[].lens_*", kOfImages, false},
    core::KnownName{"objects[].objects[].motion_blur_*", kOfImages, false},
    core::KnownName{"objects[].objects[].bloom_intensity", kOfImages, false},
    core::KnownName{"objects[].objects[].exposure_*", kOfImages, false},
    core::KnownName{"objects[].objects[].gamma", kOfImages, false},
    core::KnownName{"objects[].objects[].iso", kOfImages, false},
    core::KnownName{"objects[].objects[].shutter_speed", kOfImages, false},
    core::KnownName{"objects[].objects[].fstop", kOfImages, false},
    core::KnownName{"objects[].objects[].attached_objects", "things of CARLA", false},
    core::KnownName{"objects[].spawn_point", "where the vehicle starts: a trajectory says it",
                    false},
    core::KnownName{"objects[].attached_objects", "things of CARLA", false},
};

double number_or(const JsonValue& object, std::string_view key, double fallback) {
  if (!object.has(key)) return fallback;
  const JsonValue value = object.at(key);
  const double number = value.json().number();
  if (!std::isfinite(number)) fail(ErrorKind::Input, "{}: {} is not finite", value.where(), number);
  return number;
}

double between(const JsonValue& object, std::string_view key, double fallback, double least,
               double most) {
  const double number = number_or(object, key, fallback);
  if (!(number >= least && number <= most))
    fail(ErrorKind::Input, "{}: {} = {}; it lies from {} to {}", object.where(), key, number, least,
         most);
  return number;
}

geo::Rigid3d pose_of(const JsonValue& sensor) {
  if (!sensor.has("spawn_point")) return {};
  const JsonValue at = sensor.at("spawn_point");
  const auto angle = [&](const char* key) { return number_or(at, key, 0.0) * kDegree; };
  return {
      .rotation = Eigen::AngleAxisd(angle("yaw"), Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(angle("pitch"), Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(angle("roll"), Eigen::Vector3d::UnitX()),
      .translation = {number_or(at, "x", 0.0), number_or(at, "y", 0.0), number_or(at, "z", 0.0)}};
}

/// What is not drawn here but stands at one value: told where it is not 0.
void tell_constant(const JsonValue& sensor, std::string_view key) {
  if (sensor.has(key) && number_or(sensor, key, 0.0) != 0.0)
    sensor.at(key).pass_over("a constant error; here errors are drawn, by turn_on_radps or markov");
}

double rate_hz(const JsonValue& sensor) {
  const double tick_s = between(sensor, "sensor_tick", 0.0, 0.0, 1e4);
  return 1.0 / (tick_s > 0.0 ? tick_s : kStep_s);
}

/// The largest of an instrument's axes, which are alike here.
double largest(const JsonValue& sensor, std::initializer_list<const char*> keys) {
  std::vector<double> values;
  for (const char* key : keys) values.push_back(between(sensor, key, 0.0, 0.0, 1e9));
  const double most = *std::max_element(values.begin(), values.end());
  for (const char* key : keys)
    if (sensor.has(key) && number_or(sensor, key, 0.0) != most)
      sensor.at(key).pass_over("axes are alike here: the largest counts");
  return most;
}

sensors::SensorOptions imu_of(const JsonValue& sensor, const std::string& name) {
  for (const char* key : {"noise_gyro_bias_x", "noise_gyro_bias_y", "noise_gyro_bias_z"})
    tell_constant(sensor, key);
  const double rate = rate_hz(sensor);
  const double gyro =
      largest(sensor, {"noise_gyro_stddev_x", "noise_gyro_stddev_y", "noise_gyro_stddev_z"});
  const double accel =
      largest(sensor, {"noise_accel_stddev_x", "noise_accel_stddev_y", "noise_accel_stddev_z"});
  return imu_of_noise(sensor.where(), name,
                      {.rate_hz = rate,
                       .gyro_noise_radps_per_sqrt_hz = gyro / std::sqrt(rate),
                       .accel_noise_mps2_per_sqrt_hz = accel / std::sqrt(rate)},
                      pose_of(sensor));
}

sensors::SensorOptions gnss_of(const JsonValue& sensor, const std::string& name) {
  for (const char* key : {"noise_alt_bias", "noise_lat_bias", "noise_lon_bias"})
    tell_constant(sensor, key);
  // A degree of latitude, as CARLA's own sphere of 6378137 m has it.
  constexpr double kMetresPerDegree = 6378137.0 * kDegree;
  return sensor_of_keys(
      sensor.where(),
      fmt::format("name = \"{}\"\nkind = \"gnss\"\nrate_hz = {}\n[single]\n"
                  "noise_horizontal_m = {}\nnoise_vertical_m = {}\n",
                  name, rate_hz(sensor),
                  kMetresPerDegree * largest(sensor, {"noise_lat_stddev", "noise_lon_stddev"}),
                  between(sensor, "noise_alt_stddev", 0.0, 0.0, 1e4)),
      pose_of(sensor));
}

sensors::SensorOptions lidar_of(const JsonValue& sensor, const std::string& name) {
  const auto num_lasers =
      static_cast<std::size_t>(std::llround(between(sensor, "channels", 32.0, 1.0, 4096.0)));
  const double turns_hz = between(sensor, "rotation_frequency", 10.0, 1e-3, 1e4);
  const double points_hz = between(sensor, "points_per_second", 56000.0, 1.0, 1e9);
  const double upper_deg = between(sensor, "upper_fov", 10.0, -90.0, 90.0);
  const double lower_deg = between(sensor, "lower_fov", -30.0, -90.0, 90.0);
  // The semantic one has no light that air could take.
  const double air_per_m = sensor.at("type").json().string().ends_with("semantic") ? 0.0 : 0.004;
  const double attenuation_per_m =
      between(sensor, "atmosphere_attenuation_rate", air_per_m, 0.0, 10.0);
  if (sensor.has("horizontal_fov") && number_or(sensor, "horizontal_fov", 360.0) != 360.0)
    sensor.at("horizontal_fov").pass_over("a spinning lidar sees all around");
  if (sensor.has("sensor_tick"))
    sensor.at("sensor_tick").pass_over("scans are turns, rotation_frequency of them a second");
  const double columns = std::round(points_hz / turns_hz / static_cast<double>(num_lasers));
  if (columns < 1.0)
    fail(ErrorKind::Input,
         "{}: {} points_per_second of {} lasers at {} turns a second are less than a column a turn",
         sensor.where(), points_hz, num_lasers, turns_hz);
  std::vector<std::string> elevations;
  for (std::size_t i = 0; i < num_lasers; ++i)
    elevations.push_back(fmt::format(
        "{}", num_lasers == 1 ? upper_deg
                              : upper_deg + (lower_deg - upper_deg) * static_cast<double>(i) /
                                                static_cast<double>(num_lasers - 1)));
  return sensor_of_keys(
      sensor.where(),
      fmt::format("name = \"{}\"\nkind = \"lidar\"\nrate_hz = {}\npattern = \"spinning\"\n"
                  "columns = {}\nelevation_deg = [{}]\nleast_range_m = 0.0\nmost_range_m = {}\n"
                  "extinction_per_km = {}\nrange_noise_m = {}\n",
                  name, turns_hz, static_cast<std::int64_t>(columns), fmt::join(elevations, ", "),
                  between(sensor, "range", 10.0, 1e-3, 1e6), 500.0 * attenuation_per_m,
                  between(sensor, "noise_stddev", 0.0, 0.0, 100.0)),
      pose_of(sensor));
}

capture::CameraCalibration camera_of(const JsonValue& sensor, const std::string& name) {
  const auto side = [&](const char* key, double fallback) {
    return static_cast<int>(std::llround(between(sensor, key, fallback, 1.0, 16384.0)));
  };
  const int width_px = side("image_size_x", 800.0), height_px = side("image_size_y", 600.0);
  const double fov_deg = between(sensor, "fov", 90.0, 1e-3, 179.9);
  const double focal_px = 0.5 * width_px / std::tan(0.5 * fov_deg * kDegree);
  return {.rig = "",
          .name = name,
          .intrinsics = {.model = "pinhole",
                         .width_px = width_px,
                         .height_px = height_px,
                         .parameters = {focal_px, focal_px, 0.5 * width_px, 0.5 * height_px}},
          .rig_from_camera = pose_of(sensor) * rig_from_rdf(),
          .body_from_rig = {}};
}

bool is_camera(std::string_view type) {
  return type.starts_with("sensor.camera.") && type != "sensor.camera.dvs";
}

bool are_alike(const capture::CameraCalibration& a, const capture::CameraCalibration& b) {
  return a.intrinsics.width_px == b.intrinsics.width_px &&
         a.intrinsics.height_px == b.intrinsics.height_px &&
         a.intrinsics.parameters == b.intrinsics.parameters &&
         a.rig_from_camera.translation == b.rig_from_camera.translation &&
         a.rig_from_camera.rotation.coeffs() == b.rig_from_camera.rotation.coeffs();
}

/// Whether an object is a vehicle that has a camera; nothing of it is taken by that.
bool has_camera(const core::Json& object) {
  if (!object.is_object() || !object.has("objects") || !object.at("objects").is_array())
    return false;
  const core::Json& sensors = object.at("objects");
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const core::Json& sensor = sensors.at(i);
    if (sensor.is_object() && sensor.has("type") && is_camera(sensor.at("type").string()))
      return true;
  }
  return false;
}

/// A vehicle's sensors, each with a name of its own.
class Vehicle {
 public:
  void add(const JsonValue& sensor) {
    const JsonValue type_value = sensor.at("type");
    const std::string& type = type_value.json().string();
    const std::string name = own_name(sensor, type);
    if (is_camera(type)) {
      capture::CameraCalibration camera = camera_of(sensor, name);
      if (std::any_of(cameras_.begin(), cameras_.end(),
                      [&](const auto& other) { return are_alike(camera, other); })) {
        type_value.pass_over(kCovered);
        return;
      }
      cameras_.push_back(std::move(camera));
    } else if (type == "sensor.other.imu") {
      sensors_.push_back(imu_of(sensor, name));
    } else if (type == "sensor.other.gnss") {
      sensors_.push_back(gnss_of(sensor, name));
    } else if (type == "sensor.lidar.ray_cast" || type == "sensor.lidar.ray_cast_semantic") {
      sensors_.push_back(lidar_of(sensor, name));
    } else {
      type_value.misunderstand(type);
      return;
    }
    names_.insert(name);
  }

  RigOptions rig(const std::string& name) const {
    RigOptions rig = rig_of_cameras(name, cameras_);
    rig.sensors = sensors_;
    return rig;
  }

 private:
  std::string own_name(const JsonValue& sensor, const std::string& type) const {
    const std::string stated = safe_name(sensor.has("id") ? sensor.at("id").json().string() : type);
    std::string name = stated;
    for (int number = 2; names_.contains(name); ++number)
      name = fmt::format("{}_{}", stated, number);
    return name;
  }

  std::vector<capture::CameraCalibration> cameras_;
  std::vector<sensors::SensorOptions> sensors_;
  std::set<std::string> names_;
};

ImportedRig read_carla(const fs::path& path, const ReadOptions& options) {
  const JsonValue file = JsonValue::read(path, kMostBytes);
  std::string name = options.name;
  std::optional<Vehicle> vehicle;
  for (const JsonValue& object : file.at("objects").items()) {
    if (vehicle || !has_camera(object.json())) {
      if (object.has("type"))
        object.at("type").pass_over("not the first vehicle that has a camera, which is read");
      continue;
    }
    if (object.has("type")) object.at("type");
    const std::vector<JsonValue> sensors = object.at("objects").items();
    if (sensors.size() > kMostSensors)
      fail(ErrorKind::Input, "{}: {} sensors; a rig has at most {}", object.where(), sensors.size(),
           kMostSensors);
    if (name.empty() && object.has("id")) name = safe_name(object.at("id").json().string());
    vehicle.emplace();
    for (const JsonValue& sensor : sensors) vehicle->add(sensor);
  }
  if (!vehicle)
    fail(
        ErrorKind::Input,
        "{}: no vehicle with a camera; one of `objects` has `objects` of its own, of which one has "
        "a type that begins with sensor.camera",
        path.string());
  return {vehicle->rig(name.empty() ? safe_name(path.stem().string()) : name), file.ledger(kKnown)};
}

}  // namespace

RigFormatInfo carla_rigs() {
  return {.name = "carla",
          .summary =
              "Objects of CARLA's ROS bridge (JSON): a vehicle's cameras, lidars, IMUs and "
              "GNSS receivers. Read only.",
          .recognises =
              [](const fs::path& path, std::string_view first_bytes) {
                return path.extension() == ".json" &&
                       first_bytes.find("\"objects\"") != std::string_view::npos;
              },
          .read = read_carla,
          .known =
              [] {
                return std::vector<core::KnownTable>{{"carla", "members of a file", kKnown}};
              }};
}

}  // namespace terracast::rigs
