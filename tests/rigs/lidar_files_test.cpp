#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>

#include "core/atomic_file.h"
#include "core/choice.h"
#include "core/toml_reader.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "sensors/lidar/pattern.h"
#include "tests/rigs/lens_formulas.h"
#include "tests/rigs/shipped_rigs.h"
#include "tests/support/expect_error.h"

// Files of makers of lidars: the lines of their beams are those of the makers' formulas.
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
using test::expect_error;
namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180.0;

struct Pattern {
  core::Choice<sensors::lidar::ScanPatternInfo> choice;
  void describe(core::SchemaVisitor& visit) {
    choice.describe(visit, "pattern", "pattern", "", sensors::lidar::scan_patterns());
  }
  void validate() const { choice.validate(); }
};

/// The first scan of a rig's first lidar, by the keys that its file would have.
std::vector<sensors::lidar::Pulse> pulses_of(const RigOptions& rig) {
  std::istringstream lines(rig_toml(rig));
  std::string keys, line;
  bool is_of_first = false;
  int num_sensors = 0;
  while (std::getline(lines, line)) {
    if (line.starts_with("[[")) is_of_first = line == "[[sensors]]" && ++num_sensors == 1;
    for (const char* key : {"pattern ", "columns ", "cycle_us ", "firing_us ", "elevation_deg ",
                            "azimuth_deg ", "origin_mm ", "vertical_mm ", "across_mm "})
      if (is_of_first && line.starts_with(key)) keys += line + "\n";
  }
  Pattern pattern;
  core::TomlDocument::parse(keys, "keys").read(pattern);
  return pattern.choice->pulses(0, rig.sensors.at(0).rate_hz);
}

constexpr const char* kMatrices =
    R"("lidar_to_sensor_transform": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1])";
constexpr const char* kImuMatrix =
    R"("imu_to_sensor_transform": [1, 0, 0, 6.253, 0, 1, 0, -11.775, 0, 0, 1, 7.645, 0, 0, 0, 1])";
constexpr const char* kBeams =
    R"("beam_altitude_angles": [21.5, -7.25], "beam_azimuth_angles": [4.25, -1.5])";

std::string flat(const std::string& more) {
  return fmt::format(R"({{{}, "lidar_mode": "512x20", {}, {}{}}})", kBeams, kMatrices, kImuMatrix,
                     more);
}

ImportedRig ouster(const std::string& text) {
  const fs::path file = test_folder("ouster") / "os.json";
  core::write_file(file, text);
  EXPECT_EQ(find_rig_format(file).name, "ouster");
  return read_text("ouster", file, text);
}

/// A point at a range behind the beam's beginning, in the sensor's axes, by the formula of Ouster's manual: the encoder falls
/// from the lidar's x, azimuths are subtracted, and the lidar's axes turn by half a turn, 36.18 mm up.
Vector3d ouster_point(int column, double altitude_deg, double azimuth_deg, double origin_m,
                      double range_m) {
  const double encoder = 2.0 * std::numbers::pi * (1.0 - column / 512.0);
  const double angle = encoder - azimuth_deg * kDegree, up = altitude_deg * kDegree;
  const Vector3d lidar =
      Vector3d(range_m * std::cos(angle) * std::cos(up) + origin_m * std::cos(encoder),
               range_m * std::sin(angle) * std::cos(up) + origin_m * std::sin(encoder),
               range_m * std::sin(up));
  return {-lidar.x(), -lidar.y(), lidar.z() + 0.03618};
}

void expect_ouster_beams(const ImportedRig& read, double origin_m) {
  ASSERT_GE(read.rig.sensors.size(), 1U);
  EXPECT_EQ(read.rig.sensors[0].rate_hz, 20.0);
  const auto pulses = pulses_of(read.rig);
  ASSERT_EQ(pulses.size(), 1024U);
  const geo::Rigid3d sensor_from_lidar{
      Eigen::Quaterniond(
          Eigen::AngleAxisd(read.rig.sensors[0].euler_deg.at(0) * kDegree, Vector3d::UnitZ())),
      1e-3 * Vector3d(read.rig.sensors[0].offset_mm.at(0), read.rig.sensors[0].offset_mm.at(1),
                      read.rig.sensors[0].offset_mm.at(2))};
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    const bool is_first = pulses[i].ring == 0;
    const Vector3d truth = ouster_point(static_cast<int>(i / 2), is_first ? 21.5 : -7.25,
                                        is_first ? 4.25 : -1.5, origin_m, 50.0);
    EXPECT_LT(
        (sensor_from_lidar * (pulses[i].origin_m + 50.0 * pulses[i].direction) - truth).norm(),
        1e-10)
        << i;
  }
}

TEST(Ouster, BothLayoutsHaveTheBeamsOfTheMakersFormula) {
  expect_ouster_beams(ouster(flat(R"(, "lidar_origin_to_beam_origin_mm": 15.806)")), 0.015806);
  const ImportedRig nested = ouster(fmt::format(
      R"({{"beam_intrinsics": {{{}, "lidar_origin_to_beam_origin_mm": 15.806}}, "calibration_status": {{"a": 1}},
          "config_params": {{"lidar_mode": "512x20", "azimuth_window": [0, 360000], "udp_ip": "a"}},
          "imu_intrinsics": {{{}}}, "lidar_intrinsics": {{{}}}, "lidar_data_format": {{"column_window": [0, 511]}},
          "sensor_info": {{"prod_line": "OS-1-128"}}}})",
      kBeams, kImuMatrix, kMatrices));
  expect_ouster_beams(nested, 0.015806);
  EXPECT_EQ(nested.rig.name, "OS-1-128");
  ASSERT_EQ(nested.rig.sensors.size(), 2U);
  EXPECT_EQ(nested.rig.sensors[1].sensor.kind(), "imu");
  EXPECT_EQ(nested.rig.sensors[1].offset_mm, (std::vector<double>{6.253, -11.775, 7.645}));
  for (const std::string& line : lines_not_used(nested.ledger))
    EXPECT_EQ(line.find("window"), std::string::npos) << line;
}

TEST(Ouster, OldFilesHaveTheOriginOfTheirProduct) {
  expect_ouster_beams(
      ouster(flat(
          R"(, "prod_line": "OS-1-64", "lidar_data_format": "error: Command not recognized.")")),
      0.012163);
  expect_ouster_beams(ouster(flat(R"(, "prod_line": "OS-0-128")")), 0.02767);
  expect_ouster_beams(
      ouster(flat(
          R"(, "beam_to_lidar_transform": [1, 0, 0, 16.721, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
                                     "lidar_origin_to_beam_origin_mm": 16.721)")),
      0.016721);
}

/// Ouster Studio stores no more of a sensor than its beams and its mode.
TEST(Ouster, WithoutItsPlaceALidarStandsAsInAnOS1) {
  const ImportedRig read = ouster(fmt::format(R"({{{}, "lidar_mode": "512x20"}})", kBeams));
  expect_ouster_beams(read, 0.012163);
  EXPECT_EQ(read.rig.sensors.size(), 1U);
}

TEST(Ouster, AWindowIsTold) {
  expect_told(ouster(flat(R"(, "data_format": {"column_window": [128, 383]})")).ledger,
              {"data_format.column_window", "here all are"});
}

TEST(Ouster, WrongFilesAreToldSo) {
  const auto expect = [](std::string text, const std::string& from, const std::string& to,
                         const std::vector<std::string>& words) {
    text.replace(text.find(from), from.size(), to);
    expect_error(ErrorKind::Input, words, [&] { ouster(text); });
  };
  const std::string whole = flat("");
  expect(whole, "[4.25, -1.5]", "[4.25]", {"beam_azimuth_angles", "1 numbers", "takes 2"});
  expect(whole, "[4.25, -1.5]", "[4.25, 1e999]", {"os.json"});
  expect(whole, "21.5", "95", {"beam_altitude_angles", "elevation_deg"});
  expect(whole, "512x20", "fast", {"lidar_mode", "1024x10"});
  expect(whole, "512x20", "99999999999x20", {"lidar_mode", "1024x10"});
  expect(whole, "\"lidar_mode\"", "\"mode\"", {"lidar_mode", "config_params.lidar_mode"});
  expect(whole, "[-1, 0, 0, 0, 0, -1", "[2, 0, 0, 0, 0, -1",
         {"lidar_to_sensor_transform", "no rotation"});
}

std::string velodyne_text(int num_lasers, const std::string& more_of_first) {
  std::string text = "lasers:\n";
  for (int i = 0; i < num_lasers; ++i)
    text += fmt::format(
        "- {{laser_id: {}, vert_correction: {}, rot_correction: {}, vert_offset_correction: {}, "
        "horiz_offset_correction: {}{}}}\n",
        i, -0.4 + 0.05 * i, 0.15 - 0.02 * i, 0.2 - 0.01 * i, i % 2 == 0 ? 0.026 : -0.026,
        i == 0 ? more_of_first : "");
  return text + fmt::format("num_lasers: {}\ndistance_resolution: 0.002\n", num_lasers);
}

ImportedRig velodyne(const std::string& text) {
  const fs::path file = test_folder("velodyne") / "db.yaml";
  core::write_file(file, text);
  EXPECT_EQ(find_rig_format(file).name, "velodyne");
  return read_text("velodyne", file, text);
}

/// Points of a beam by the corrections' definition, with x forward, y left: D along a laser's own azimuth, which is clockwise and
/// less by rot_correction, and the offsets across the beam.
TEST(Velodyne, BeamsAreTheLinesOfTheirCorrections) {
  const ImportedRig read = velodyne(velodyne_text(12, ""));
  const auto pulses = pulses_of(read.rig);
  ASSERT_EQ(pulses.size(), 12U * 1800U);
  for (const auto& pulse : pulses) {
    const int i = pulse.ring;
    const double up = -0.4 + 0.05 * i, v = 0.2 - 0.01 * i, h = i % 2 == 0 ? 0.026 : -0.026;
    const double azimuth = 2.0 * std::numbers::pi * 10.0 * pulse.time_s - (0.15 - 0.02 * i);
    for (const double range_m : {2.0, 120.0}) {
      const double level = range_m * std::cos(up) - v * std::sin(up);
      const Vector3d truth(level * std::cos(azimuth) + h * std::sin(azimuth),
                           -level * std::sin(azimuth) + h * std::cos(azimuth),
                           range_m * std::sin(up) + v * std::cos(up));
      EXPECT_LT((truth - pulse.origin_m).cross(pulse.direction).norm(), 1e-10)
          << i << " " << pulse.time_s;
    }
  }
  EXPECT_NE(rig_toml(read.rig).find("range_step_m = 0.002"), std::string::npos);
}

TEST(Velodyne, HeadsOfSixteenFireAsTheManualSays) {
  const auto pulses = pulses_of(velodyne(velodyne_text(16, "")).rig);
  // 0.1 s of cycles of 55.296 us.
  EXPECT_NEAR(static_cast<double>(pulses.size()), 16.0 * 0.1 / 55.296e-6, 16.0);
  EXPECT_NEAR(pulses[3].time_s - pulses[0].time_s, 3 * 2.304e-6, 1e-15);
}

TEST(Velodyne, CorrectionsOfMeasurementsAreToldAndWrongFilesRefused) {
  expect_told(velodyne(velodyne_text(2, ", dist_correction: 0.1")).ledger,
              {"lasers[].dist_correction", "corrects ranges"});
  expect_told(velodyne(velodyne_text(2, "") + "more: 1\n").ledger, {"more"});
  const auto expect = [](std::string text, const std::string& from, const std::string& to,
                         const std::vector<std::string>& words) {
    text.replace(text.find(from), from.size(), to);
    expect_error(ErrorKind::Input, words, [&] { velodyne(text); });
  };
  const std::string whole = velodyne_text(2, "");
  expect(whole, "laser_id: 1", "laser_id: 0", {"laser_id", "stands twice"});
  expect(whole, "laser_id: 1", "laser_id: 1e9", {"laser_id", "0 to 1"});
  expect(whole, "vert_correction: -0.4", "vert_correction: -15", {"vert_correction", "-15"});
  expect(whole, "vert_correction: -0.4", "vert_correction: .nan", {"vert_correction"});
  expect(whole, "vert_correction: -0.4, ", "", {"vert_correction", "radians"});
}

/// Of Ouster's sensor frame: half a turn about z, 36.18 mm up; whatever the axes of the rig's file.
TEST(LidarFiles, TheirSensorsAreAddedToARigWithACamera) {
  const ImportedRig read = ouster(flat(""));
  for (const char* name : {"mcs4", "tartan2"}) {  // rdf, flu
    SCOPED_TRACE(name);
    RigOptions rig = shipped_rig(name);
    const std::size_t before = rig.sensors.size();
    add_sensors(read.rig, rig);
    add_sensors(read.rig, rig);
    ASSERT_EQ(rig.sensors.size(), before + 4);
    EXPECT_EQ(rig.sensors.back().name, "imu_2");
    const auto mounted = mount_sensors({rig});
    const geo::Rigid3d& lidar = mounted.at(before).info.rig_from_sensor;
    EXPECT_LT((lidar * Vector3d(1.0, 2.0, 3.0) - Vector3d(-1.0, -2.0, 3.03618)).norm(), 1e-12);
    const geo::Rigid3d& imu = mounted.at(before + 1).info.rig_from_sensor;
    EXPECT_LT((imu * Vector3d(0.0, 0.0, 1.0) - Vector3d(0.006253, -0.011775, 1.007645)).norm(),
              1e-12);
    const fs::path file = test_folder("onto") / "rig.toml";
    core::write_file(file, rig_toml(rig));
    EXPECT_EQ(rig_toml(read_rig(file)), rig_toml(rig));
  }
}

}  // namespace
}  // namespace terracast::rigs
