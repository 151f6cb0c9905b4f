#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/support/listed_files.h"
#include "tests/support/report_results.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

/// A flight with inertial units and what navigates through the whole program: its datasets hold, and wrong samples are
/// found.
namespace terracast::test {
namespace {

constexpr const char* kJob = R"(name = "job"
world = {{name = "job", origin_lat_deg = 46.0, origin_lon_deg = 7.0, size_m = 512.0, outside = "extend", elevation = [{{kind = "plane", vertical_datum = "ellipsoid", height_m = 500.0}}]}}
detail.finest_spacing_m = 2.0
trajectories = [{{name = "P000", kind = "orbit", centre = {{east_m = 0.0, north_m = 0.0, height_m = 150.0, above = "ground"}}, radius_m = 120.0, speed_mps = 20.0, rate_hz = 5.0, num_frames = 12}}]
conditions.color_samples = 1

[[rigs]]
name = "down"
mount_pitch_deg = 60.0
cameras = [{{name = "cam", width_px = 48, height_px = 36, fx_px = 45.0}}]

[[rigs.sensors]]
name = "fast"
kind = "imu"
rate_hz = 200.0
offset_mm = [300.0, -200.0, 100.0]
euler_deg = [30.0, 10.0, 180.0]
gyroscope = "{0}/adis16448_kalibr/gyroscope.toml"
accelerometer = "{0}/adis16448_kalibr/accelerometer.toml"

[[rigs.sensors]]
name = "means"
kind = "imu"
rate_hz = 90.0
sampling = "integrated"

[[rigs.sensors]]
name = "receiver"
kind = "gnss"
rate_hz = 10.0
offset_mm = [-500.0, 100.0, 400.0]
single = "{0}/gnss_ins_sim_low/single.toml"

[[rigs.sensors]]
name = "air"
kind = "barometer"
rate_hz = 25.0
sea_level_pressure_pa = 100800.0
errors = "{0}/px4_gazebo/barometer.toml"

[[rigs.sensors]]
name = "compass"
kind = "magnetometer"
rate_hz = 50.0
euler_deg = [90.0, 0.0, 0.0]
errors = "{0}/gnss_ins_sim_low/magnetometer.toml"

[[exports]]
format = "terracast"

[[exports]]
format = "colmap"

[[exports]]
format = "coco"
rig = "down"
)";

/// A table with one column changed.
std::string with_column(const std::string& table, const std::string& name,
                        const std::function<double(double)>& change) {
  std::istringstream lines(table);
  std::string line, text;
  std::size_t column = 0;
  while (std::getline(lines, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    if (text.empty())
      column =
          static_cast<std::size_t>(std::find(cells.begin(), cells.end(), name) - cells.begin());
    else
      cells.at(column) = fmt::format("{}", change(std::stod(cells.at(column))));
    text += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return text;
}

TEST(InertialFlight, HoldsAndWrongSamplesAreFound) {
  const ScratchFolder scratch;
  core::write_file(scratch / "job.toml",
                   fmt::format(kJob, TERRACAST_SOURCE_DIR "/configs/sensors"));
  const auto out = scratch / "out";
  const ProgramResult run =
      run_program({"run", (scratch / "job.toml").string(), "--out", out.string(), "--quiet"});
  ASSERT_EQ(run.status, 0) << run.output;
  // The flight begins at 7 degrees east, where the geoid steps between two cells of its grid; places of coco are rounded.
  for (const char* format : {"terracast", "colmap", "coco"}) {
    const core::Json report = core::Json::read(out / "report" / format / "report.json");
    for (const char* name :
         {"inertial_position", "inertial_rotation", "navigation_position", "navigation_velocity",
          "navigation_fixes", "navigation_sea_level", "navigation_pressure", "navigation_field"}) {
      EXPECT_TRUE(result_of(report, name).at("ok").boolean()) << format << ", " << name;
      EXPECT_FALSE(result_of(report, name).at("unseen").boolean()) << format << ", " << name;
    }
  }
  const auto dataset = out / "export/terracast";
  // Of a sensor's table one column is changed, and the result must say so.
  const auto expect_found = [&](const std::string& sensor, const std::string& column,
                                const std::string& result,
                                const std::function<double(double)>& change) {
    const std::filesystem::path file = dataset / fmt::format("P000/sensors/down/{}.csv", sensor);
    const std::string right = core::read_text_file(file);
    core::write_file(file, with_column(right, column, change));
    list_files_again(dataset);
    const ProgramResult validated = run_program(
        {"validate", dataset.string(), "--report", (scratch / "report").string(), "--quiet"});
    EXPECT_EQ(validated.status, 1) << validated.output;
    const core::Json found = result_of(core::Json::read(scratch / "report/report.json"), result);
    EXPECT_FALSE(found.at("ok").boolean()) << column;
    EXPECT_NE(found.at("worst").string().find(sensor + ".csv"), std::string::npos) << column;
    core::write_file(file, right);
  };
  const auto negated = [](double value) { return -value; };
  expect_found("means", "true_accel_z_mps2", "inertial_position", negated);
  // A state that is a centimetre away.
  expect_found("means", "ecef_y_m", "sensors", [](double place) { return place + 0.01; });
  expect_found("receiver", "true_velocity_east_mps", "navigation_velocity", negated);
  expect_found("compass", "true_field_z_nt", "navigation_field", negated);
}

}  // namespace
}  // namespace terracast::test
