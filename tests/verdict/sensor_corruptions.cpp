#include "tests/verdict/sensor_corruptions.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <utility>

#include "core/atomic_file.h"
#include "core/json.h"
#include "geo/gravity.h"
#include "tests/verdict/tables.h"
#include "validate/npy.h"

namespace terracast::test {

namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr double kRadian_deg = 57.29577951308232;
constexpr double kEarthRate_radps = 7.292115e-5;

/// A sensor as sensors.json describes it.
struct Sensor {
  fs::path sequence;  ///< the folder
  core::Json json;
  std::string kind() const { return json.at("kind").string(); }
  bool has_clock() const { return json.has("clock"); }
  bool is_at_body() const {
    const std::vector<double> at = json.at("body_from_sensor").at("translation_m").numbers();
    return at == std::vector<double>{0.0, 0.0, 0.0};
  }
  fs::path file() const { return sequence / json.at("file").string(); }
};

std::vector<Sensor> sensors_of(const fs::path& dataset) {
  std::vector<Sensor> sensors;
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(dataset))
    if (entry.path().filename() == "sensors.json") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const core::Json list = core::Json::read(file).at("sensors");
    for (std::size_t i = 0; i < list.size(); ++i)
      sensors.push_back({file.parent_path(), list.at(i)});
  }
  return sensors;
}

/// Rows of a sensor's table by the names of their columns.
class Rows {
 public:
  explicit Rows(const Sensor& sensor) : table_(read_table(sensor.file(), ',', true)) {}

  std::size_t size() const { return table_.num_rows(); }
  std::size_t column(const std::string& name) const {
    const auto& names = table_.rows.front();
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  }
  bool has(const std::string& name) const { return column(name) < table_.rows.front().size(); }
  double get(std::size_t row, const std::string& name) const {
    return number_of(table_.rows[row + 1][column(name)]);
  }
  void set(std::size_t row, const std::string& name, double value) {
    table_.rows[row + 1][column(name)] = text_of(value);
  }
  Vector3d vector(std::size_t row, const std::string& start, const std::string& end) const {
    return {get(row, start + "x" + end), get(row, start + "y" + end), get(row, start + "z" + end)};
  }
  void set_vector(std::size_t row, const std::string& start, const std::string& end,
                  const Vector3d& value) {
    for (int axis = 0; axis < 3; ++axis) set(row, start + "xyz"[axis] + end, value[axis]);
  }
  /// The rows' texts: but for the time.
  std::vector<std::vector<std::string>>& texts() { return table_.rows; }
  void write() const { table_.write(); }

 private:
  Table table_;
};

/// Changes the tables of one kind of sensor in each sequence, of the first one that fits.
bool edit(const fs::path& dataset, const std::function<bool(const Sensor&)>& fits,
          const std::function<bool(const Sensor&, Rows&)>& change) {
  std::map<fs::path, bool> is_done;
  for (const Sensor& sensor : sensors_of(dataset)) {
    if (is_done[sensor.sequence] || !fits(sensor)) continue;
    Rows rows(sensor);
    if (!change(sensor, rows)) continue;
    rows.write();
    is_done[sensor.sequence] = true;
  }
  return std::any_of(is_done.begin(), is_done.end(), [](const auto& one) { return one.second; });
}
std::function<bool(const Sensor&)> of_kind(const std::string& kind) {
  return [kind](const Sensor& sensor) { return sensor.kind() == kind; };
}

/// Both what an instrument shows and its truth.
constexpr std::array kShownAndTrue = {"", "true_"};

/// The attitude of an IMU at a row: sensor to Earth.
Eigen::Quaterniond attitude_at(const Rows& rows, std::size_t row) {
  return {rows.get(row, "ecef_qw"), rows.get(row, "ecef_qx"), rows.get(row, "ecef_qy"),
          rows.get(row, "ecef_qz")};
}

/// Adds something along the sensor's axes to an IMU's readings.
/// ecef   what is added, along the Earth's axes, by place and velocity
bool add_to_imu(
    const fs::path& dataset, const std::string& instrument, const std::string& end,
    const std::function<Vector3d(const Vector3d& place, const Vector3d& velocity)>& ecef) {
  return edit(dataset, of_kind("imu"), [&](const Sensor&, Rows& rows) {
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const Vector3d more =
          attitude_at(rows, row).conjugate() *
          ecef(rows.vector(row, "ecef_", "_m"), rows.vector(row, "ecef_v", "_mps"));
      for (const std::string of : kShownAndTrue)
        rows.set_vector(row, of + instrument, end, rows.vector(row, of + instrument, end) + more);
    }
    return rows.size() > 0;
  });
}

/// Normal gravity along the Earth's axes, by the renderer's own code.
Vector3d gravity_ecef(const Vector3d& place) {
  static const geo::WorldFrame frame(
      geo::Geodetic{.lat_deg = 46.0, .lon_deg = 7.0, .height_m = 0.0});
  const geo::Rigid3d& ecef_from_world = frame.ecef_from_world();
  return ecef_from_world.rotation *
         geo::gravity_world_mps2(frame, ecef_from_world.inverse() * place);
}

bool flip_gravity(const fs::path& dataset, Draws&, double) {
  return add_to_imu(dataset, "accel_", "_mps2", [](const Vector3d& place, const Vector3d&) {
    return Vector3d(2.0 * gravity_ecef(place));
  });
}
bool leave_out_gravity(const fs::path& dataset, Draws&, double) {
  return add_to_imu(dataset, "accel_", "_mps2",
                    [](const Vector3d& place, const Vector3d&) { return gravity_ecef(place); });
}
bool set_gravity(const fs::path& dataset, Draws&, double) {
  return add_to_imu(dataset, "accel_", "_mps2", [](const Vector3d& place, const Vector3d&) {
    const Vector3d g = gravity_ecef(place);
    return Vector3d(g - 9.81 * g.normalized());
  });
}
bool leave_out_earth_rate(const fs::path& dataset, Draws&, double) {
  return add_to_imu(dataset, "gyro_", "_radps", [](const Vector3d&, const Vector3d&) {
    return Vector3d(0.0, 0.0, -kEarthRate_radps);
  });
}
bool leave_out_coriolis(const fs::path& dataset, Draws&, double) {
  return add_to_imu(dataset, "accel_", "_mps2", [](const Vector3d&, const Vector3d& velocity) {
    return Vector3d(-2.0 * Vector3d(0.0, 0.0, kEarthRate_radps).cross(velocity));
  });
}

/// Vectors of a sensor's channels, each by another.
bool change_vectors(const fs::path& dataset, const std::string& kind, const std::string& start,
                    const std::string& end,
                    const std::function<Vector3d(const Vector3d&)>& change) {
  return edit(dataset, of_kind(kind), [&](const Sensor&, Rows& rows) {
    for (std::size_t row = 0; row < rows.size(); ++row)
      for (const std::string of : kShownAndTrue)
        rows.set_vector(row, of + start, end, change(rows.vector(row, of + start, end)));
    return rows.size() > 0;
  });
}
bool turn_rates_in_degrees(const fs::path& dataset, Draws&, double) {
  return change_vectors(dataset, "imu", "gyro_", "_radps",
                        [](const Vector3d& v) { return Vector3d(kRadian_deg * v); });
}
bool exchange_force_axes(const fs::path& dataset, Draws&, double) {
  return change_vectors(dataset, "imu", "accel_", "_mps2",
                        [](const Vector3d& v) { return Vector3d(v.y(), v.x(), v.z()); });
}
bool right_down(const fs::path& dataset, Draws&, double) {
  const auto turn = [](const Vector3d& v) { return Vector3d(v.x(), -v.y(), -v.z()); };
  return change_vectors(dataset, "imu", "accel_", "_mps2", turn) &&
         change_vectors(dataset, "imu", "gyro_", "_radps", turn);
}
bool field_in_microtesla(const fs::path& dataset, Draws&, double) {
  return change_vectors(dataset, "magnetometer", "field_", "_nt",
                        [](const Vector3d& v) { return Vector3d(1e-3 * v); });
}
bool exchange_field_axes(const fs::path& dataset, Draws&, double) {
  return change_vectors(dataset, "magnetometer", "field_", "_nt",
                        [](const Vector3d& v) { return Vector3d(v.z(), v.y(), v.x()); });
}

/// Columns of all rows that hold the row before's.
bool delay(const fs::path& dataset, const std::string& kind,
           const std::function<bool(const std::string&)>& is_delayed) {
  return edit(dataset, of_kind(kind), [&](const Sensor&, Rows& rows) {
    auto& texts = rows.texts();
    if (texts.size() < 12) return false;
    for (std::size_t column = 1; column < texts[0].size(); ++column)
      for (std::size_t row = texts.size() - 1; is_delayed(texts[0][column]) && row > 1; --row)
        texts[row][column] = texts[row - 1][column];
    return true;
  });
}
bool delay_readings(const fs::path& dataset, Draws&, double) {
  return delay(dataset, "imu", [](const std::string& name) {
    return name.find("gyro_") != std::string::npos ||
           (name.find("accel_") != std::string::npos && name.find("bias") == std::string::npos);
  });
}
bool delay_fixes(const fs::path& dataset, Draws&, double) {
  return delay(dataset, "gnss", [](const std::string& name) { return name != "stamp_s"; });
}

/// Rows of a receiver.
bool change_fixes(const fs::path& dataset,
                  const std::function<void(Rows&, std::size_t, const std::string& of)>& change) {
  return edit(dataset, of_kind("gnss"), [&](const Sensor&, Rows& rows) {
    for (std::size_t row = 0; row < rows.size(); ++row)
      for (const char* of : kShownAndTrue) change(rows, row, of);
    return rows.size() > 0;
  });
}
void exchange(Rows& rows, std::size_t row, const std::string& a, const std::string& b) {
  const double first = rows.get(row, a);
  rows.set(row, a, rows.get(row, b));
  rows.set(row, b, first);
}
bool exchange_coordinates(const fs::path& dataset, Draws&, double) {
  return change_fixes(dataset, [](Rows& rows, std::size_t row, const std::string& of) {
    exchange(rows, row, of + "lat_deg", of + "lon_deg");
  });
}
bool coordinates_in_radians(const fs::path& dataset, Draws&, double) {
  return change_fixes(dataset, [](Rows& rows, std::size_t row, const std::string& of) {
    for (const char* name : {"lat_deg", "lon_deg"})
      rows.set(row, of + name, rows.get(row, of + name) / kRadian_deg);
  });
}
bool exchange_heights(const fs::path& dataset, Draws&, double) {
  return change_fixes(dataset, [](Rows& rows, std::size_t row, const std::string& of) {
    exchange(rows, row, of + "height_m", of + "altitude_msl_m");
  });
}
bool height_above_geoid(const fs::path& dataset, Draws&, double) {
  return change_fixes(dataset, [](Rows& rows, std::size_t row, const std::string& of) {
    rows.set(row, of + "height_m", rows.get(row, of + "altitude_msl_m"));
  });
}
bool velocity_east_first(const fs::path& dataset, Draws&, double) {
  return change_fixes(dataset, [](Rows& rows, std::size_t row, const std::string& of) {
    exchange(rows, row, of + "velocity_north_mps", of + "velocity_east_mps");
    rows.set(row, of + "velocity_down_mps", -rows.get(row, of + "velocity_down_mps"));
  });
}

bool pressure_in_hectopascals(const fs::path& dataset, Draws&, double) {
  return edit(dataset, of_kind("barometer"), [](const Sensor&, Rows& rows) {
    for (std::size_t row = 0; row < rows.size(); ++row)
      for (const char* name : {"pressure_pa", "true_pressure_pa"})
        rows.set(row, name, 0.01 * rows.get(row, name));
    return rows.size() > 0;
  });
}

/// States a mount where the samples are those of the body's reference point.
bool state_arm(const fs::path& dataset, const std::string& kind) {
  bool is_done = false;
  std::map<fs::path, bool> seen;
  for (const Sensor& sensor : sensors_of(dataset)) {
    if (sensor.kind() != kind || !sensor.is_at_body() || seen[sensor.sequence]) continue;
    seen[sensor.sequence] = true;
    const auto rotation_of = [&](const char* mount) {
      const std::vector<double> q = sensor.json.at(mount).at("quaternion_wxyz").numbers();
      return Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
    };
    const Vector3d arm(0.7, -0.4, 1.1);
    const Eigen::Quaterniond rig_from_body =
        rotation_of("rig_from_sensor") * rotation_of("body_from_sensor").conjugate();
    const fs::path file = sensor.sequence / "sensors.json";
    core::Json whole = core::Json::read(file), list = core::Json::array();
    for (std::size_t i = 0; i < whole.at("sensors").size(); ++i) {
      core::Json one = whole.at("sensors").at(i);
      if (one.at("name").string() == sensor.json.at("name").string() &&
          one.at("rig").string() == sensor.json.at("rig").string())
        for (const auto& [mount, moved] :
             {std::pair{"body_from_sensor", arm},
              std::pair{"rig_from_sensor", Vector3d(rig_from_body * arm)}}) {
          const std::vector<double> t = one.at(mount).at("translation_m").numbers();
          core::Json pose = one.at(mount);
          pose.set("translation_m",
                   core::Json::array_of({t[0] + moved.x(), t[1] + moved.y(), t[2] + moved.z()}));
          one.set(mount, std::move(pose));
        }
      list.push(std::move(one));
    }
    whole.set("sensors", std::move(list));
    core::write_file(file, whole.text() + "\n");
    is_done = true;
  }
  return is_done;
}
bool leave_out_imu_arm(const fs::path& dataset, Draws&, double) {
  return state_arm(dataset, "imu");
}
bool leave_out_antenna(const fs::path& dataset, Draws&, double) {
  return state_arm(dataset, "gnss");
}

/// Stamps of the first sensor with a clock and enough samples.
bool change_stamps(const fs::path& dataset,
                   const std::function<void(const Sensor&, Rows&)>& change) {
  return edit(
      dataset, [](const Sensor& sensor) { return sensor.has_clock() && sensor.json.has("file"); },
      [&](const Sensor& sensor, Rows& rows) {
        if (rows.size() < 12) return false;
        change(sensor, rows);
        return true;
      });
}
bool map_stamps(const fs::path& dataset, const std::function<double(double)>& change) {
  return change_stamps(dataset, [&](const Sensor&, Rows& rows) {
    for (std::size_t row = 0; row < rows.size(); ++row)
      rows.set(row, "stamp_s", change(rows.get(row, "stamp_s")));
  });
}
bool stamps_in_milliseconds(const fs::path& dataset, Draws&, double) {
  return map_stamps(dataset, [](double stamp_s) { return 1e3 * stamp_s; });
}
bool stamps_in_nanoseconds(const fs::path& dataset, Draws&, double) {
  return map_stamps(dataset, [](double stamp_s) { return 1e9 * stamp_s; });
}
bool shift_stamps(const fs::path& dataset, Draws&, double) {
  return map_stamps(dataset, [](double stamp_s) { return stamp_s + 0.0123; });
}
bool gps_stamps(const fs::path& dataset, Draws&, double) {
  return map_stamps(dataset, [](double stamp_s) { return stamp_s + 18.0; });
}
bool drift_stamps(const fs::path& dataset, Draws&, double) {
  return change_stamps(dataset, [](const Sensor&, Rows& rows) {
    for (std::size_t row = 0; row < rows.size(); ++row)
      rows.set(row, "stamp_s", rows.get(row, "stamp_s") + 0.004 * rows.get(row, "time_s"));
  });
}
/// Each row's stamp is that of the row before, by the clock that is stated.
bool delay_stamps(const fs::path& dataset, Draws&, double) {
  return change_stamps(dataset, [](const Sensor& sensor, Rows& rows) {
    const double step_s = 1.0 / sensor.json.at("rate_hz").number();
    const double drift = sensor.json.at("clock").at("drift").number();
    for (std::size_t row = rows.size(); row-- > 1;)
      rows.set(row, "stamp_s", rows.get(row - 1, "stamp_s"));
    rows.set(0, "stamp_s", rows.get(1, "stamp_s") - step_s * (1.0 + drift));
  });
}
bool disorder_stamps(const fs::path& dataset, Draws& draws, double) {
  return change_stamps(dataset, [&](const Sensor&, Rows& rows) {
    const auto at = static_cast<std::size_t>(draws.below(static_cast<int>(rows.size()) - 3));
    const double first = rows.get(at, "stamp_s");
    rows.set(at, "stamp_s", rows.get(at + 2, "stamp_s"));
    rows.set(at + 2, "stamp_s", first);
  });
}
/// By what another sensor's clock shows, without its jitter.
bool stamps_of_another(const fs::path& dataset, Draws&, double) {
  const std::vector<Sensor> all = sensors_of(dataset);
  bool is_changed = false;
  const bool is_done = change_stamps(dataset, [&](const Sensor& sensor, Rows& rows) {
    for (const Sensor& other : all) {
      if (other.sequence != sensor.sequence || !other.has_clock() ||
          other.json.at("name").string() == sensor.json.at("name").string())
        continue;
      const core::Json& clock = other.json.at("clock");
      for (std::size_t row = 0; row < rows.size(); ++row) {
        const double time_s = rows.get(row, "time_s");
        rows.set(row, "stamp_s",
                 time_s + clock.at("offset_s").number() + clock.at("drift").number() * time_s);
      }
      is_changed = true;
      return;
    }
  });
  return is_done && is_changed;
}

/// The scans of a lidar, file by file.
class ScanFile {
 public:
  explicit ScanFile(fs::path file)
      : file_(std::move(file)),
        bytes_(core::read_file(file_)),
        table_(validate::parse_npy_table(bytes_, file_.string())) {}

  std::size_t size() const { return table_.num_rows; }
  double get(std::size_t row, const std::string& column) const {
    return table_.number(table_.column(column, ""), row);
  }
  void set(std::size_t row, const std::string& column, double value) {
    table_.set_number(table_.column(column, ""), row, value);
  }
  void write() {
    std::memcpy(bytes_.data() + (bytes_.size() - table_.bytes.size()), table_.bytes.data(),
                table_.bytes.size());
    core::write_file(file_, bytes_);
  }

 private:
  fs::path file_;
  std::vector<std::byte> bytes_;
  validate::NpyTable table_;
};

bool edit_scans(const fs::path& dataset, const std::function<bool(const Sensor&)>& fits,
                const std::function<void(const Sensor&, ScanFile&)>& change) {
  bool is_done = false;
  for (const Sensor& sensor : sensors_of(dataset)) {
    if (sensor.kind() != "lidar" || !fits(sensor)) continue;
    for (const auto& entry :
         fs::directory_iterator(sensor.sequence / sensor.json.at("folder").string())) {
      if (entry.path().extension() != ".npy") continue;
      ScanFile scans(entry.path());
      if (scans.size() == 0) continue;
      change(sensor, scans);
      scans.write();
      is_done = true;
    }
  }
  return is_done;
}
bool is_any(const Sensor&) { return true; }

/// Of a head's lasers.
int num_rings(const Sensor& sensor) {
  const std::string toml = sensor.json.at("settings_toml").string();
  const std::size_t at = toml.find("elevation_deg = [");
  if (at == std::string::npos || toml.find("pattern = \"spinning\"") == std::string::npos) return 0;
  const std::string list = toml.substr(at, toml.find(']', at) - at);
  return 1 + static_cast<int>(std::count(list.begin(), list.end(), ','));
}
bool turn_rings(const fs::path& dataset, Draws&, double) {
  return edit_scans(
      dataset, [](const Sensor& sensor) { return num_rings(sensor) > 1; },
      [](const Sensor& sensor, ScanFile& scans) {
        for (std::size_t row = 0; row < scans.size(); ++row)
          scans.set(row, "ring", num_rings(sensor) - 1 - scans.get(row, "ring"));
      });
}
bool exchange_point_axes(const fs::path& dataset, Draws&, double) {
  return edit_scans(dataset, &is_any, [](const Sensor&, ScanFile& scans) {
    for (std::size_t row = 0; row < scans.size(); ++row) {
      const double x = scans.get(row, "x_m");
      scans.set(row, "x_m", scans.get(row, "y_m"));
      scans.set(row, "y_m", -x);
    }
  });
}
bool range_along_axis(const fs::path& dataset, Draws&, double) {
  return edit_scans(dataset, &is_any, [](const Sensor&, ScanFile& scans) {
    for (std::size_t row = 0; row < scans.size(); ++row) {
      const double depth_m = std::abs(scans.get(row, "x_m"));
      const double error_m = scans.get(row, "true_range_m") - scans.get(row, "range_m");
      scans.set(row, "range_m", depth_m);
      scans.set(row, "true_range_m", depth_m + error_m);
    }
  });
}
/// By the time of the pulse before; of the first that of its own.
bool delay_points(const fs::path& dataset, Draws&, double) {
  return edit_scans(dataset, &is_any, [](const Sensor&, ScanFile& scans) {
    for (std::size_t row = 0; row < scans.size(); ++row)
      scans.set(row, "time_s", scans.get(row, "time_s") + 0.004);
  });
}

Corruption plain(const char* name, bool (*corrupt)(const fs::path&, Draws&, double),
                 std::vector<std::string> checks, const char* cause) {
  return {.name = name,
          .unit = "",
          .least = 0.0,
          .most = 0.0,
          .corrupt = corrupt,
          .measures = {},
          .checks = std::move(checks),
          .causes = {cause}};
}

const std::vector<std::string> kInertial = {"inertial_position", "inertial_rotation"};
const std::vector<std::string> kPosition = {"navigation_position", "navigation_fixes"};
const std::vector<std::string> kClocks = {"clocks_stamps", "clocks_offset", "clocks_drift"};
const std::vector<std::string> kLidar = {"lidar", "lidar_place"};

}  // namespace

std::vector<Corruption> plain_sensor_corruptions() {
  return {
      plain("gravity of forces downwards", &flip_gravity, kInertial, "imu_gravity_sign"),
      plain("forces without gravity", &leave_out_gravity, kInertial, "imu_gravity_missing"),
      plain("turn rates in degrees", &turn_rates_in_degrees, kInertial, "imu_unit"),
      plain("latitudes for longitudes", &exchange_coordinates, kPosition, "gnss_swapped"),
      plain("places in radians", &coordinates_in_radians, kPosition, "gnss_unit"),
      plain("pressures in hectopascals", &pressure_in_hectopascals, {"navigation_pressure"},
            "baro_unit"),
      plain("fields in microtesla", &field_in_microtesla, {"navigation_field"}, "mag_unit"),
      plain("axes of points exchanged", &exchange_point_axes, kLidar, "lidar_axes"),
      plain("rings from the other end", &turn_rings, kLidar, "lidar_ring_order"),
      plain("stamps in milliseconds", &stamps_in_milliseconds, kClocks, "clock_unit"),
      plain("stamps of GPS time", &gps_stamps, kClocks, "clock_time_scale"),
      plain("stamps in another order", &disorder_stamps, kClocks, "clock_order"),
  };
}

std::vector<Corruption> subtle_sensor_corruptions() {
  return {
      plain("9.81 m/s^2 everywhere", &set_gravity, kInertial, "imu_gravity_constant"),
      plain("turn rates without the Earth's", &leave_out_earth_rate, kInertial, "imu_earth_rate"),
      plain("forces without Coriolis' force", &leave_out_coriolis, kInertial, "imu_coriolis"),
      plain("forces without the lever arm", &leave_out_imu_arm, kInertial, "imu_arm"),
      plain("readings a sample late", &delay_readings, kInertial, "sensor_late"),
      plain("axes of forces exchanged", &exchange_force_axes, kInertial, "imu_axes"),
      plain("readings forward, right, down", &right_down, kInertial, "imu_axes"),
      plain("heights in each other's columns", &exchange_heights, kPosition, "gnss_heights"),
      plain("heights above the geoid", &height_above_geoid, kPosition, "gnss_height_msl"),
      plain("velocities east first", &velocity_east_first, {"navigation_velocity"},
            "gnss_velocity_axes"),
      plain("fixes a sample late", &delay_fixes, kPosition, "sensor_late"),
      plain("places without the lever arm", &leave_out_antenna, kPosition, "antenna_left_out"),
      plain("axes of fields exchanged", &exchange_field_axes, {"navigation_field"}, "mag_axes"),
      plain("ranges along an axis", &range_along_axis, kLidar, "lidar_range_axis"),
      plain("points a while late", &delay_points, kLidar, "lidar_late"),
      plain("stamps in nanoseconds", &stamps_in_nanoseconds, kClocks, "clock_unit"),
      plain("stamps of another offset", &shift_stamps, kClocks, "clock_offset"),
      plain("stamps that drift", &drift_stamps, kClocks, "clock_drift"),
      plain("stamps a sample late", &delay_stamps, kClocks, "clock_late"),
      plain("stamps of another sensor", &stamps_of_another, kClocks, "clock_of_other"),
  };
}

}  // namespace terracast::test
