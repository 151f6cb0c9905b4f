#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/support/listed_files.h"
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

/// The value and state of a result of a report.
core::Json result_of(const core::Json& report, const std::string& name) {
  for (std::size_t i = 0; i < report.at("checks").size(); ++i)
    if (report.at("checks").at(i).at("name").string() == name) return report.at("checks").at(i);
  ADD_FAILURE() << "no result " << name;
  return core::Json::object();
}

/// Writes a table of samples anew, each row changed.
void change_rows(const std::filesystem::path& file,
                 const std::function<std::string(const std::string&)>& changed) {
  std::string wrong;
  const std::string text = core::read_text_file(file);
  for (std::size_t at = 0, line = 0; at < text.size(); ++line) {
    const std::size_t end = text.find('\n', at);
    const std::string row = text.substr(at, end - at);
    wrong += (line == 0 ? row : changed(row)) + "\n";
    at = end + 1;
  }
  core::write_file(file, wrong);
}

/// A row with a column negated, counted from the last, 0.
std::string with_negated(const std::string& row, int column_from_end) {
  std::size_t before = row.rfind(',');
  for (int i = 0; i < column_from_end; ++i) before = row.rfind(',', before - 1);
  const std::string head = row.substr(0, before + 1), tail = row.substr(before + 1);
  return head + (tail.starts_with('-') ? tail.substr(1) : "-" + tail);
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
  // Of the truth, gravity, the velocity to the east and the field upwards with the other sign.
  const auto dataset = out / "export/terracast";
  for (const auto& [sensor, column] : {std::pair{"means", 0}, {"receiver", 1}, {"compass", 0}})
    change_rows(dataset / fmt::format("P000/sensors/down/{}.csv", sensor),
                [&](const std::string& row) { return with_negated(row, column); });
  list_files_again(dataset);
  const ProgramResult validated = run_program(
      {"validate", dataset.string(), "--report", (scratch / "report").string(), "--quiet"});
  EXPECT_EQ(validated.status, 1) << validated.output;
  const core::Json report = core::Json::read(scratch / "report/report.json");
  for (const auto& [name, file] : {std::pair{"inertial_position", "means.csv"},
                                   {"navigation_velocity", "receiver.csv"},
                                   {"navigation_field", "compass.csv"}}) {
    EXPECT_FALSE(result_of(report, name).at("ok").boolean()) << name;
    EXPECT_NE(result_of(report, name).at("worst").string().find(file), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace terracast::test
