#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "rigs/imported_sensor.h"
#include "rigs/json_value.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"

// A sensor's metadata as Ouster's tools store them: all members in one object (firmware 1.12 to 3, "legacy"), or in an object for each
// of the sensor's commands. The rig is Ouster's sensor frame: x away from the connector, z up, mm in the file. Azimuths of beams are
// clockwise, and the head turns clockwise from the lidar frame's x. https://github.com/ouster-lidar/ouster-sdk
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using core::fail;
namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = std::size_t{1} << 22;
constexpr double kImuRate_hz = 100.0;  // of all of Ouster's sensors

constexpr const char* kOfDevice = "which device it is, and its software";
constexpr const char* kOfNetwork = "how the device sends and stamps, which changes no beam";
constexpr const char* kOfPackets = "how pixels are laid out in packets and images";
constexpr const char* kWindow = "first and last column that are sent, counted from 0: here all are";

constexpr std::array kKnown = {
    core::KnownName{"beam_intrinsics", "the beams, one object a command"},
    core::KnownName{"beam_intrinsics.beam_altitude_angles", "elevation_deg"},
    core::KnownName{"beam_intrinsics.beam_azimuth_angles", "azimuth_deg, which is their negative"},
    core::KnownName{"beam_intrinsics.lidar_origin_to_beam_origin_mm", "origin_mm"},
    core::KnownName{"beam_intrinsics.beam_to_lidar_transform", "origin_mm and vertical_mm"},
    core::KnownName{"beam_altitude_angles", "elevation_deg"},
    core::KnownName{"beam_azimuth_angles", "azimuth_deg, which is their negative"},
    core::KnownName{"lidar_origin_to_beam_origin_mm", "origin_mm"},
    core::KnownName{"beam_to_lidar_transform", "origin_mm and vertical_mm"},
    core::KnownName{"lidar_intrinsics", "the lidar's place"},
    core::KnownName{"lidar_intrinsics.lidar_to_sensor_transform", "the lidar's place, mm"},
    core::KnownName{"lidar_to_sensor_transform", "the lidar's place, mm"},
    core::KnownName{"imu_intrinsics", "the IMU's place"},
    core::KnownName{"imu_intrinsics.imu_to_sensor_transform", "the IMU's place, mm"},
    core::KnownName{"imu_to_sensor_transform", "the IMU's place, mm"},
    core::KnownName{"config_params", "settings"},
    core::KnownName{"config_params.lidar_mode", "columns a turn, and turns a second"},
    core::KnownName{"config_params.azimuth_window",
                    "all of a turn, 0 to 360000 thousandths of a degree"},
    core::KnownName{"config_params.*", kOfNetwork, false},
    core::KnownName{"lidar_mode", "columns a turn, and turns a second"},
    core::KnownName{"lidar_data_format", "which columns are sent"},
    core::KnownName{"lidar_data_format.column_window", "all columns, 0 to the last"},
    core::KnownName{"lidar_data_format.columns_per_packet", kOfPackets, false},
    core::KnownName{"lidar_data_format.columns_per_frame", "is that of lidar_mode", false},
    core::KnownName{"lidar_data_format.pixel_shift_by_row", kOfPackets, false},
    core::KnownName{"lidar_data_format.pixels_per_column", "the number of beams", false},
    core::KnownName{"lidar_data_format.udp_profile_*", kOfNetwork, false},
    core::KnownName{"data_format", "which columns are sent"},
    core::KnownName{"data_format.column_window", "all columns, 0 to the last"},
    core::KnownName{"data_format.columns_per_packet", kOfPackets, false},
    core::KnownName{"data_format.columns_per_frame", "is that of lidar_mode", false},
    core::KnownName{"data_format.pixel_shift_by_row", kOfPackets, false},
    core::KnownName{"data_format.pixels_per_column", "the number of beams", false},
    core::KnownName{"data_format.udp_profile_*", kOfNetwork, false},
    core::KnownName{"sensor_info", "the sensor's name"},
    core::KnownName{"sensor_info.prod_line", "the rig's name"},
    core::KnownName{"sensor_info.*", kOfDevice, false},
    core::KnownName{"prod_line", "the rig's name"},
    core::KnownName{"prod_*", kOfDevice, false},
    core::KnownName{"base_*", kOfDevice, false},
    core::KnownName{"build_*", kOfDevice, false},
    core::KnownName{"hostname", kOfDevice, false},
    core::KnownName{"image_rev", kOfDevice, false},
    core::KnownName{"initialization_id", kOfDevice, false},
    core::KnownName{"json_calibration_version", kOfDevice, false},
    core::KnownName{"proto_rev", kOfDevice, false},
    core::KnownName{"status", kOfDevice, false},
    core::KnownName{"calibration_status", "when reflectivities were calibrated", false},
    core::KnownName{"client_version", kOfDevice, false},
    core::KnownName{"ouster-sdk", kOfDevice, false},
    core::KnownName{"user_data", "the user's own notes", false},
    core::KnownName{"udp_*", kOfNetwork, false},
};

/// The metadata in either layout: a member is in the object of its command, or beside all others.
class Metadata {
 public:
  explicit Metadata(JsonValue root) : root_(std::move(root)) {}

  std::optional<JsonValue> find(std::string_view command, std::string_view member) const {
    // Of a command that the firmware does not know its object is a text.
    if (root_.has(command) && root_.json().at(command).is_object()) {
      const JsonValue object = root_.at(command);
      if (object.has(member)) return object.at(member);
    } else if (root_.has(command)) {
      root_.at(command).pass_over("no object: the device did not answer");
    }
    if (root_.has(member)) return root_.at(member);
    return std::nullopt;
  }
  JsonValue at(std::string_view command, std::string_view member) const {
    if (auto found = find(command, member)) return *found;
    fail(ErrorKind::Input, "{} has neither {} nor {}.{}", root_.where(), member, command, member);
  }
  const JsonValue& root() const { return root_; }

 private:
  JsonValue root_;
};

std::vector<double> finite_numbers(const JsonValue& value, std::size_t count) {
  std::vector<double> numbers = value.json().numbers();
  if (count > 0 && numbers.size() != count)
    fail(ErrorKind::Input, "{} has {} numbers; it takes {}", value.where(), numbers.size(), count);
  for (const double number : numbers)
    if (!std::isfinite(number))
      fail(ErrorKind::Input, "{}: {} is not finite", value.where(), number);
  return numbers;
}

/// Of sixteen numbers row by row, mm.
geo::Rigid3d transform(const JsonValue& value) {
  const std::vector<double> numbers = finite_numbers(value, 16);
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(numbers.data());
  const Eigen::Matrix3d turn = matrix.topLeftCorner<3, 3>();
  constexpr double kTolerance = 1e-3;  // as printed digits leave it
  if ((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm() > kTolerance ||
      turn.determinant() < 0.0 || matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    fail(ErrorKind::Input,
         "{} is no rotation with a translation: three rows of a rotation and millimetres, then 0 "
         "0 0 1",
         value.where());
  return {.rotation = Eigen::Quaterniond(turn).normalized(),
          .translation = 1e-3 * matrix.topRightCorner<3, 1>()};
}

/// Of files without it, as Ouster's tools take it: half a turn, and the height of an OS-1's lidar.
geo::Rigid3d default_sensor_from_lidar() {
  return {.rotation = Eigen::Quaterniond(0.0, 0.0, 0.0, 1.0), .translation = {0.0, 0.0, 0.03618}};
}

struct Mode {
  int columns;
  int turns_hz;
};

/// "1024x10"
Mode mode_of(const JsonValue& value) {
  const std::string& text = value.json().string();
  Mode mode{};
  const char* const end = text.data() + text.size();
  const auto columns = std::from_chars(text.data(), end, mode.columns);
  if (columns.ec == std::errc() && columns.ptr != end && *columns.ptr == 'x') {
    const auto turns = std::from_chars(columns.ptr + 1, end, mode.turns_hz);
    if (turns.ec == std::errc() && turns.ptr == end && mode.columns >= 1 && mode.columns <= 65536 &&
        mode.turns_hz >= 1 && mode.turns_hz <= 1000)
      return mode;
  }
  fail(ErrorKind::Input,
       "{}: \"{}\" is no mode; one like 1024x10 is wanted, columns a turn and turns a second",
       value.where(), text.substr(0, 80));
}

/// What is cut out of a turn is told.
void tell_window(const Metadata& metadata, std::string_view command, std::string_view member,
                 double last) {
  const auto window = metadata.find(command, member);
  if (!window) return;
  const std::vector<double> numbers = finite_numbers(*window, 2);
  if (numbers[0] != 0.0 || numbers[1] != last) window->pass_over(kWindow);
}

struct Origin {
  double ahead_mm = 0.0, up_mm = 0.0;
};

/// Where beams begin, the way that the head looks.
Origin origin_of(const Metadata& metadata, const std::string& product) {
  Origin origin;
  const auto stated = metadata.find("beam_intrinsics", "lidar_origin_to_beam_origin_mm");
  if (const auto full = metadata.find("beam_intrinsics", "beam_to_lidar_transform")) {
    const geo::Rigid3d lidar_from_beam = transform(*full);
    if (lidar_from_beam.rotation.vec().norm() > 1e-9 ||
        std::abs(lidar_from_beam.translation.y()) > 1e-12)
      fail(ErrorKind::Input,
           "{} turns the beams, or moves them across; a head's beams begin ahead and above",
           full->where());
    origin = {1e3 * lidar_from_beam.translation.x(), 1e3 * lidar_from_beam.translation.z()};
    if (stated &&
        std::abs(stated->json().number() - std::hypot(origin.ahead_mm, origin.up_mm)) > 1e-3)
      stated->misunderstand(fmt::format("{}, and another in beam_to_lidar_transform, which counts",
                                        stated->json().number()));
    return origin;
  }
  if (stated) {
    origin.ahead_mm = stated->json().number();
    if (!(std::abs(origin.ahead_mm) <= 1e3))
      fail(ErrorKind::Input, "{} = {}; it takes -1000 to 1000", stated->where(), origin.ahead_mm);
    return origin;
  }
  // Files of before firmware 2.0 state none: that of the first OS-1, as Ouster's tools take it.
  origin.ahead_mm = product.starts_with("OS-0-")   ? 27.67
                    : product.starts_with("OS-2-") ? 13.762
                                                   : 12.163;
  return origin;
}

sensors::SensorOptions lidar_of(const Metadata& metadata, const std::string& product) {
  const JsonValue altitudes = metadata.at("beam_intrinsics", "beam_altitude_angles");
  const std::vector<double> elevation_deg = finite_numbers(altitudes, 0);
  std::vector<double> azimuth_deg =
      finite_numbers(metadata.at("beam_intrinsics", "beam_azimuth_angles"), elevation_deg.size());
  for (double& angle : azimuth_deg) angle = angle == 0.0 ? 0.0 : -angle;
  const Mode mode = mode_of(metadata.at("config_params", "lidar_mode"));
  tell_window(metadata, "lidar_data_format", "column_window", mode.columns - 1.0);
  tell_window(metadata, "data_format", "column_window", mode.columns - 1.0);
  tell_window(metadata, "config_params", "azimuth_window", 360000.0);
  const Origin origin = origin_of(metadata, product);
  std::string keys = fmt::format(
      "name = \"lidar\"\nkind = \"lidar\"\nrate_hz = {}.0\npattern = \"spinning\"\ncolumns = {}\n"
      "elevation_deg = [{}]\nazimuth_deg = [{}]\norigin_mm = {}\n",
      mode.turns_hz, mode.columns, fmt::join(elevation_deg, ", "), fmt::join(azimuth_deg, ", "),
      origin.ahead_mm);
  if (origin.up_mm != 0.0)
    keys += fmt::format("vertical_mm = [{}]\n",
                        fmt::join(std::vector<double>(elevation_deg.size(), origin.up_mm), ", "));
  const auto stated = metadata.find("lidar_intrinsics", "lidar_to_sensor_transform");
  return sensor_of_keys(altitudes.where(), keys,
                        stated ? transform(*stated) : default_sensor_from_lidar());
}

ImportedRig read_ouster(const fs::path& path, const ReadOptions& options) {
  const Metadata metadata(JsonValue::read(path, kMostBytes));
  const auto line = metadata.find("sensor_info", "prod_line");
  const std::string product = line ? line->json().string() : "";
  ImportedRig read;
  read.rig.name = !options.name.empty()
                      ? options.name
                      : safe_name(product.empty() ? path.stem().string() : product);
  read.rig.sensors.push_back(lidar_of(metadata, product));
  if (const auto imu = metadata.find("imu_intrinsics", "imu_to_sensor_transform"))
    read.rig.sensors.push_back(
        imu_of_noise(imu->where(), "imu", {.rate_hz = kImuRate_hz}, transform(*imu)));
  read.ledger = metadata.root().ledger(kKnown);
  return read;
}

}  // namespace

RigFormatInfo ouster_rigs() {
  return {.name = "ouster",
          .summary = "Metadata of an Ouster sensor (JSON): its lidar and its IMU. Read only.",
          .is_of_sensors = true,
          .recognises =
              [](const fs::path& path, std::string_view first_bytes) {
                return path.extension() == ".json" &&
                       (first_bytes.find("\"beam_altitude_angles\"") != std::string_view::npos ||
                        first_bytes.find("\"beam_intrinsics\"") != std::string_view::npos);
              },
          .read = read_ouster,
          .known =
              [] {
                return std::vector<core::KnownTable>{{"ouster", "members of a file", kKnown}};
              }};
}

}  // namespace terracast::rigs
