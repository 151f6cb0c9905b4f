// A flight with sensors of every kind, spoilt in every way that the catalogue has for them: each is found, and called what
// it is and nothing else.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/support/listed_files.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/verdict/sensor_corruptions.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJob = R"(name = "job"
world = {{name = "job", origin_lat_deg = 46.0, origin_lon_deg = 7.0, size_m = 512.0, outside = "extend", elevation = [{{kind = "plane", vertical_datum = "ellipsoid", height_m = 500.0}}]}}
detail.finest_spacing_m = 2.0
trajectories = [{{name = "P001", kind = "waypoints", closed = true, speed_mps = 15.0, rate_hz = 10.0, num_frames = 60, waypoints = [{{east_m = 0.0, north_m = 0.0, height_m = 40.0, above = "ground"}}, {{east_m = 60.0, north_m = 20.0, height_m = 50.0, above = "ground"}}, {{east_m = 40.0, north_m = 70.0, height_m = 30.0, above = "ground"}}]}}, {{name = "P000", kind = "orbit", centre = {{east_m = 0.0, north_m = 0.0, height_m = 50.0, above = "ground"}}, radius_m = 60.0, speed_mps = 12.0, rate_hz = 10.0, num_frames = 12}}]
conditions.color_samples = 1

[[rigs]]
name = "down"
mount_pitch_deg = 60.0
cameras = [{{name = "cam", width_px = 32, height_px = 24, fx_px = 30.0}}]

[[rigs.sensors]]
name = "centre"
kind = "imu"
rate_hz = 200.0
euler_deg = [30.0, 10.0, 20.0]
clock = {{offset_s = 0.02, offset_sd_s = 0.003, drift_ppm = 15.0, drift_sd_ppm = 4.0, jitter_sd_s = 2e-5}}
gyroscope = "{0}/adis16448_kalibr/gyroscope.toml"
accelerometer = "{0}/adis16448_kalibr/accelerometer.toml"

[[rigs.sensors]]
name = "receiver"
kind = "gnss"
rate_hz = 10.0
single = "{0}/gnss_ins_sim_low/single.toml"

[[rigs.sensors]]
name = "air"
kind = "barometer"
rate_hz = 20.0
offset_mm = [100.0, 50.0, 20.0]

[[rigs.sensors]]
name = "compass"
kind = "magnetometer"
rate_hz = 20.0
euler_deg = [40.0, 20.0, 10.0]
clock = {{offset_s = -0.6}}

[[rigs.sensors]]
name = "spin"
kind = "lidar"
rate_hz = 10.0
offset_mm = [300.0, -200.0, 100.0]
euler_deg = [30.0, 10.0, 180.0]
cycle_us = 2000.0
range_noise_m = 0.01
clock = {{drift_ppm = -40.0, jitter_sd_s = 1e-5}}

[[exports]]
format = "terracast"
)";

std::set<std::string> causes_of(const core::Json& report, std::string& words) {
  std::set<std::string> names;
  const core::Json& causes = report.at("causes");
  for (std::size_t i = 0; i < causes.size(); ++i) {
    names.insert(causes.at(i).at("name").string());
    words += "\n" + causes.at(i).at("words").string();
  }
  return names;
}

TEST(SensorCauses, AreCalledWhatTheyAreAndNothingElse) {
  const ScratchFolder scratch;
  core::write_file(scratch / "job.toml",
                   fmt::format(kJob, TERRACAST_SOURCE_DIR "/configs/sensors"));
  const fs::path out = scratch / "out";
  const ProgramResult run =
      run_program({"run", (scratch / "job.toml").string(), "--out", out.string(), "--quiet"});
  ASSERT_EQ(run.status, 0) << run.output;
  std::vector<Corruption> all = plain_sensor_corruptions();
  for (const Corruption& one : subtle_sensor_corruptions()) all.push_back(one);
  for (const Corruption& corruption : all) {
    const fs::path dataset = scratch / "spoilt";
    fs::remove_all(dataset);
    fs::copy(out / "export/terracast", dataset, fs::copy_options::recursive);
    Draws draws(1, corruption.name);
    ASSERT_TRUE(corruption.corrupt(dataset, draws, 0.0)) << corruption.name;
    list_files_again(dataset);
    const ProgramResult validated = run_program(
        {"validate", dataset.string(), "--report", (scratch / "report").string(), "--quiet"});
    EXPECT_EQ(validated.status, 1) << corruption.name << ": " << validated.output;
    std::string words;
    const core::Json report = core::Json::read(scratch / "report/report.json");
    std::string failed;
    for (std::size_t i = 0; i < report.at("checks").size(); ++i)
      if (!report.at("checks").at(i).at("ok").boolean())
        failed += "\n" + report.at("checks").at(i).at("name").string() + ": " +
                  report.at("checks").at(i).at("worst").string();
    EXPECT_EQ(causes_of(report, words),
              std::set<std::string>(corruption.causes.begin(), corruption.causes.end()))
        << corruption.name << words << failed;
  }
}

}  // namespace
}  // namespace terracast::test
