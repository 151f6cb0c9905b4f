#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/support/listed_files.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

/// A flight with inertial units through the whole program: its datasets hold, and wrong samples are found.
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

[[exports]]
format = "terracast"

[[exports]]
format = "colmap"
)";

/// The value and state of a result of a report.
core::Json result_of(const core::Json& report, const std::string& name) {
  for (std::size_t i = 0; i < report.at("checks").size(); ++i)
    if (report.at("checks").at(i).at("name").string() == name) return report.at("checks").at(i);
  ADD_FAILURE() << "no result " << name;
  return core::Json::object();
}

TEST(InertialFlight, HoldsAndWrongSamplesAreFound) {
  const ScratchFolder scratch;
  core::write_file(scratch / "job.toml",
                   fmt::format(kJob, TERRACAST_SOURCE_DIR "/configs/sensors"));
  const auto out = scratch / "out";
  const ProgramResult run =
      run_program({"run", (scratch / "job.toml").string(), "--out", out.string(), "--quiet"});
  ASSERT_EQ(run.status, 0) << run.output;
  for (const char* format : {"terracast", "colmap"}) {
    const core::Json report = core::Json::read(out / "report" / format / "report.json");
    for (const char* name : {"inertial_position", "inertial_rotation"}) {
      EXPECT_TRUE(result_of(report, name).at("ok").boolean()) << format << ", " << name;
      EXPECT_FALSE(result_of(report, name).at("unseen").boolean()) << format << ", " << name;
    }
  }
  // Gravity with the other sign: the truth's last column.
  const auto dataset = out / "export/terracast";
  const auto file = dataset / "P000/sensors/down/means.csv";
  std::string wrong;
  const std::string text = core::read_text_file(file);
  for (std::size_t at = 0, line = 0; at < text.size(); ++line) {
    const std::size_t end = text.find('\n', at);
    std::string row = text.substr(at, end - at);
    if (line > 0) {
      const std::size_t last = row.rfind(',') + 1;
      row =
          row.substr(0, last) + (row[last] == '-' ? row.substr(last + 1) : "-" + row.substr(last));
    }
    wrong += row + "\n";
    at = end + 1;
  }
  core::write_file(file, wrong);
  list_files_again(dataset);
  const ProgramResult validated = run_program(
      {"validate", dataset.string(), "--report", (scratch / "report").string(), "--quiet"});
  EXPECT_EQ(validated.status, 1) << validated.output;
  const core::Json report = core::Json::read(scratch / "report/report.json");
  EXPECT_FALSE(result_of(report, "inertial_position").at("ok").boolean());
  EXPECT_NE(result_of(report, "inertial_position").at("worst").string().find("means.csv"),
            std::string::npos);
}

}  // namespace
}  // namespace terracast::test
