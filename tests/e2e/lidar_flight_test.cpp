#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/support/listed_files.h"
#include "tests/support/report_results.h"
#include "tests/support/run_program.h"
#include "tests/support/scan_table.h"
#include "tests/support/test_data.h"

/// A flight with scanners through the whole program: its datasets hold, and wrong points are found.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJob = R"(name = "job"
world = {name = "job", origin_lat_deg = 46.0, origin_lon_deg = 7.0, size_m = 512.0, outside = "extend", elevation = [{kind = "plane", vertical_datum = "ellipsoid", height_m = 500.0}]}
detail.finest_spacing_m = 2.0
trajectories = [{name = "P001", kind = "waypoints", closed = true, speed_mps = 15.0, rate_hz = 5.0, num_frames = 24, waypoints = [{east_m = 0.0, north_m = 0.0, height_m = 40.0, above = "ground"}, {east_m = 60.0, north_m = 20.0, height_m = 50.0, above = "ground"}, {east_m = 40.0, north_m = 70.0, height_m = 30.0, above = "ground"}]}, {name = "P000", kind = "orbit", centre = {east_m = 0.0, north_m = 0.0, height_m = 50.0, above = "ground"}, radius_m = 60.0, speed_mps = 12.0, rate_hz = 10.0, num_frames = 8}]
conditions.color_samples = 1

[[rigs]]
name = "down"
mount_pitch_deg = 60.0
cameras = [{name = "cam", width_px = 48, height_px = 36, fx_px = 45.0}]

[[rigs.sensors]]
name = "spin"
kind = "lidar"
rate_hz = 10.0
offset_mm = [300.0, -200.0, 100.0]
euler_deg = [30.0, 10.0, 180.0]
cycle_us = 553.0
range_noise_m = 0.03
range_step_m = 0.002
origin_mm = 20.0

[[rigs.sensors]]
name = "line"
kind = "lidar"
rate_hz = 50.0
pattern = "polygon"
pulse_hz = 20000.0
rays = 7
divergence_mrad = 3.0
most_returns = 3
most_range_m = 1000.0

[[exports]]
format = "terracast"
clouds = ["las", "pcd", "ply"]

[[exports]]
format = "colmap"

[[exports]]
format = "coco"
)";

TEST(LidarFlight, HoldsAndWrongPointsAreFound) {
  const ScratchFolder scratch;
  core::write_file(scratch / "job.toml", kJob);
  const fs::path out = scratch / "out";
  const ProgramResult run =
      run_program({"run", (scratch / "job.toml").string(), "--out", out.string(), "--quiet"});
  ASSERT_EQ(run.status, 0) << run.output;
  // P001 has knots, at which angular acceleration jumps, and two scans a file.
  for (const char* format : {"terracast", "colmap", "coco"}) {
    const core::Json report = core::Json::read(out / "report" / format / "report.json");
    for (const char* name : {"lidar", "lidar_place", "lidar_surface"}) {
      EXPECT_TRUE(result_of(report, name).at("ok").boolean()) << format << ", " << name;
      EXPECT_FALSE(result_of(report, name).at("skipped").boolean()) << format << ", " << name;
    }
  }

  const fs::path right = out / "export/terracast";
  const auto failed = [&](const std::string& result, const std::string& name,
                          const std::function<void(const fs::path&)>& spoil) {
    const fs::path dataset = scratch / name;
    fs::copy(right, dataset, fs::copy_options::recursive);
    for (int frame = 0; frame < 8; ++frame)
      spoil(dataset / fmt::format("P000/sensors/down/spin/{:06}.npy", frame));
    list_files_again(dataset);
    const ProgramResult validated =
        run_program({"validate", dataset.string(), "--world", (out / "world").string(), "--report",
                     (scratch / (name + "_report")).string(), "--quiet"});
    EXPECT_EQ(validated.status, 1) << name << ": " << validated.output;
    const core::Json report = core::Json::read(scratch / (name + "_report") / "report.json");
    EXPECT_FALSE(result_of(report, result).at("ok").boolean()) << name;
    fs::remove_all(dataset);
  };
  // 6.6 mm of the body's way.
  failed("lidar_place", "one_cycle_late", [](const fs::path& file) {
    ScanTable(file).map("time_s", [](std::size_t, double time_s) { return time_s + 553e-6; });
  });
  failed("lidar_place", "pose_of_the_frame", [](const fs::path& file) {
    ScanTable table(file);
    const double begin_s = table.get("time_s", 0);
    std::vector<double> times_s;
    for (std::size_t row = 0; row < table.size(); ++row) times_s.push_back(0.0);
    table.map("time_s", [&](std::size_t row, double time_s) { return times_s[row] = time_s; });
    table.map("local_x_m",
              [&](std::size_t row, double x_m) { return x_m - 12.0 * (times_s[row] - begin_s); });
  });
  failed("lidar_place", "other_axes", [](const fs::path& file) {
    ScanTable table(file);
    std::vector<double> x_m(table.size());
    table.map("x_m", [&](std::size_t row, double value) { return x_m[row] = value; });
    std::vector<double> y_m(table.size());
    table.map("y_m", [&](std::size_t row, double value) {
      y_m[row] = value;
      return x_m[row];
    });
    table.map("x_m", [&](std::size_t row, double) { return y_m[row]; });
  });
  failed("lidar_surface", "a_millimetre_low", [](const fs::path& file) {
    ScanTable(file).map("local_z_m", [](std::size_t, double z_m) { return z_m - 1e-3; });
  });
  failed("lidar", "other_order", [](const fs::path& file) {
    ScanTable table(file);
    const double first_s = table.get("time_s", 0), last_s = table.get("time_s", table.size() - 1);
    table.set("time_s", 0, last_s);
    table.set("time_s", table.size() - 1, first_s);
  });
  failed("lidar", "other_rings", [](const fs::path& file) {
    ScanTable table(file);
    for (std::size_t row = 0; row < table.size(); ++row)
      table.set("ring", row, 15.0 - table.get("ring", row));
  });
  failed("lidar", "beyond_its_noise", [](const fs::path& file) {
    ScanTable(file).map("range_m", [](std::size_t row, double range_m) {
      return row == 7 ? range_m + 0.5 : range_m;
    });
  });
}

/// A byte of each cloud is changed that means another point, and the file is listed anew.
TEST(LidarFlight, CloudsOfOtherFormsAreHeldAgainstTheScans) {
  const ScratchFolder scratch;
  core::write_file(scratch / "job.toml", kJob);
  const fs::path out = scratch / "out";
  ASSERT_EQ(run_program({"run", (scratch / "job.toml").string(), "--out", out.string(), "--quiet",
                         "--set", "trajectories.1.num_frames=3"})
                .status,
            0);
  const fs::path dataset = out / "export/terracast";
  EXPECT_FALSE(fs::exists(out / "export/colmap/P000/sensors/down/spin/000000.ply"));
  for (const char* name : {"000001.ply", "000001.pcd", "strip_000.las"}) {
    const fs::path file = dataset / "P000/sensors/down/spin" / name;
    const std::vector<std::byte> right = core::read_file(file);
    // Of the last point but some, within its x: 0.4 mm of LAS, 1e-2 m of a float32, as much of a double.
    const std::string form = file.extension().string();
    const std::size_t row_bytes = form == ".las" ? 47 : form == ".ply" ? 45 : 33;
    const std::size_t byte = form == ".las" ? 0 : form == ".ply" ? 5 : 1;
    std::vector<std::byte> wrong = right;
    wrong[right.size() - 10 * row_bytes + byte] ^= std::byte{0x04};
    core::write_file(file, wrong);
    list_files_again(dataset);
    const ProgramResult validated = run_program(
        {"validate", dataset.string(), "--report", (scratch / "report").string(), "--quiet"});
    EXPECT_EQ(validated.status, 1) << name;
    const core::Json result = result_of(core::Json::read(scratch / "report/report.json"), "lidar");
    EXPECT_FALSE(result.at("ok").boolean()) << name;
    EXPECT_NE(result.at("worst").string().find(name), std::string::npos)
        << result.at("worst").string();
    core::write_file(file, right);
  }
}

}  // namespace
}  // namespace terracast::test
