// EuRoC's and TUM's layouts through the whole program: a flight of two cameras and two IMUs, read by a second reader; and
// datasets that are wrong, each found and named.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/support/listed_files.h"
#include "tests/support/report_results.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using testing::HasSubstr;

constexpr const char* kJob = R"(name = "job"
world = {{name = "job", origin_lat_deg = 46.0, origin_lon_deg = 7.0, size_m = 512.0, outside = "extend", elevation = [{{kind = "plane", vertical_datum = "ellipsoid", height_m = 500.0}}]}}
detail.finest_spacing_m = 2.0
trajectories = [{{name = "P000", kind = "orbit", centre = {{east_m = 0.0, north_m = 0.0, height_m = 150.0, above = "ground"}}, radius_m = 120.0, speed_mps = 20.0, rate_hz = 15.0, num_frames = 16, utc_start = "2025-06-21T10:00:00.123456789Z"}}]
conditions.color_samples = 1

[[rigs]]
name = "pair"
mount_pitch_deg = 60.0
{1}

[[rigs.cameras]]
name = "left"
model = "opencv"
width_px = 64
height_px = 48
fx_px = 45.0
fy_px = 45.5
k1 = -0.28
k2 = 0.07
p1 = 0.0002

[[rigs.cameras]]
name = "right"
model = "opencv_fisheye"
width_px = 64
height_px = 48
fx_px = 45.0
fy_px = 45.0
k1 = 0.01
offset_mm = [0.0, -110.0, 0.0]

[[rigs.sensors]]
name = "fast"
kind = "imu"
rate_hz = 200.0
offset_mm = [30.0, -20.0, 10.0]
euler_deg = [30.0, 10.0, 180.0]
gyroscope = "{0}/adis16448_kalibr/gyroscope.toml"
accelerometer = "{0}/adis16448_kalibr/accelerometer.toml"

[[rigs.sensors]]
name = "means"
kind = "imu"
rate_hz = 90.0
sampling = "integrated"

[[exports]]
format = "euroc"
calibration = "{2}"

[[exports]]
format = "tum"
depth_factor = 200.0
)";

/// Runs the job.
/// returns   the dataset
fs::path make_dataset(const fs::path& folder, const std::string& rig_keys = "",
                      const std::string& calibration = "true") {
  core::write_file(folder / "job.toml", fmt::format(kJob, TERRACAST_SOURCE_DIR "/configs/sensors",
                                                    rig_keys, calibration));
  const ProgramResult run = run_program(
      {"run", (folder / "job.toml").string(), "--out", (folder / "out").string(), "--quiet"});
  EXPECT_EQ(run.status, 0) << run.output;
  return folder / "out/export/euroc";
}

/// The lines of a text changed, but for those that are comments.
std::string with_lines(const std::string& text,
                       const std::function<std::string(const std::string&)>& change) {
  std::istringstream lines(text);
  std::string line, result;
  while (std::getline(lines, line)) result += (line.starts_with("#") ? line : change(line)) + "\n";
  return result;
}

/// Rows with their cells in another order.
std::function<std::string(const std::string&)> in_order(const std::vector<std::size_t>& order) {
  return [order](const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    std::vector<std::string> moved = cells;
    for (std::size_t i = 0; i < order.size(); ++i) moved[i] = cells.at(order[i]);
    return fmt::format("{}", fmt::join(moved, ","));
  };
}

TEST(EurocFlight, HoldsAndReadsAsOthersReadIt) {
  const ScratchFolder scratch;
  const fs::path dataset = make_dataset(scratch / "job");
  const fs::path report = scratch / "job/out/report/euroc";
  for (const char* name : {"structure", "sensors", "inertial_position", "inertial_rotation",
                           "calibration_intrinsics", "reprojection_position", "oracle_depth"}) {
    const Json result = result_in(report, name);
    EXPECT_TRUE(result.at("ok").boolean()) << name;
    EXPECT_FALSE(result.at("unseen").boolean()) << name;
  }
  if (run_command("python3", {"--version"}).status != 0) GTEST_SKIP() << "no python3";
  const ProgramResult read = run_command(
      "python3", {TERRACAST_SOURCE_DIR "/tests/e2e/euroc_reader.py", (dataset / "P000").string()});
  ASSERT_EQ(read.status, 0) << read.output;
  std::istringstream lines(read.output);
  std::map<std::string, double> measures;
  std::string name;
  for (double value = 0.0; lines >> name >> value;) measures[name] = value;
  EXPECT_EQ(measures.at("images"), 16.0);
  // A parabola through places 5 ms apart: jerk of 0.6 m/s^3, and nine decimals.
  EXPECT_LT(measures.at("velocity"), 5e-6);
  // The mean of 200 readings: densities times sqrt(200) over sqrt(200), three axes; a reader that knows no Earth is off by
  // its turning, 7e-5 rad/s, and by the Coriolis force of 20 m/s, 3e-3 m/s^2.
  EXPECT_LT(measures.at("rate"), 4.0 * std::sqrt(3.0) * 1.87e-4 + 7.3e-5);
  EXPECT_LT(measures.at("force"), 4.0 * std::sqrt(3.0) * 1.86e-3 + 3e-3);
}

/// Blank-parted rows with their cells in another order.
std::string with_blanks_in_order(const std::string& text, const std::vector<std::size_t>& order) {
  return with_lines(text, [&](const std::string& line) {
    std::istringstream row(line);
    std::vector<std::string> cells, moved;
    for (std::string cell; row >> cell;) cells.push_back(cell);
    for (const std::size_t cell : order) moved.push_back(cells.at(cell));
    return fmt::format("{}", fmt::join(moved, " "));
  });
}

TEST(TumFlight, HoldsAndWrongFilesAreFoundAndNamed) {
  const ScratchFolder scratch;
  make_dataset(scratch / "job");
  for (const char* name : {"structure", "georeference_position", "georeference_rotation",
                           "reprojection_position", "oracle_depth", "sensors"}) {
    const Json result = result_in(scratch / "job/out/report/tum", name);
    EXPECT_TRUE(result.at("ok").boolean()) << name;
    EXPECT_FALSE(result.at("unseen").boolean()) << name;
  }
  const fs::path dataset = scratch / "job/out/export/tum";
  struct Row {
    std::string file;
    std::function<std::string(const std::string&)> change;
    const char* check;
    const char* words;
  };
  const auto scalar_first = [](const std::string& text) {
    return with_blanks_in_order(text, {0, 1, 2, 3, 7, 4, 5, 6});
  };
  const auto replace = [](const std::string& from, const std::string& to) {
    return [from, to](std::string text) {
      const std::size_t at = text.find(from);
      EXPECT_NE(at, std::string::npos) << from;
      return at == std::string::npos ? text : text.replace(at, from.size(), to);
    };
  };
  const std::string left = "pair/left/";
  const std::vector<Row> wrong = {
      {left + "groundtruth.txt", scalar_first, "georeference_rotation", ""},
      {"trajectories/body.txt", scalar_first, "structure", "deg off"},
      {"trajectories/pair/fast.txt", scalar_first, "structure", "deg off"},
      {"trajectories/pair/fast.txt", replace("1750500000.1", "1750500000.2"), "structure",
       "fast.txt"},
      {left + "groundtruth.txt", replace("\n# timestamp", "\n#\n# timestamp"), "structure",
       "3 lines that begin with #"},
      {left + "rgb.txt", replace("rgb/1750500000.1", "rgb/1750500000.2"), "structure",
       "the file is rgb/1750500000.2"},
      {left + "associations.txt",
       [](const std::string& text) {
         return with_blanks_in_order(text, {2, 3, 0, 1});
       },
       "structure", "not rgb/"},
      {left + "depth.txt", replace("depth_factor: 200", "depth_factor: 5000"), "structure",
       "5000 a metre"},
  };
  for (const Row& row : wrong) {
    SCOPED_TRACE(row.file + ": " + row.words);
    const fs::path file = dataset / "P000" / row.file;
    const std::string right = core::read_text_file(file);
    core::write_file(file, row.change(right));
    list_files_again(dataset);
    EXPECT_EQ(run_program({"validate", dataset.string(), "--report", (scratch / "report").string(),
                           "--quiet"})
                  .status,
              1);
    const Json result = result_in(scratch / "report", row.check);
    EXPECT_FALSE(result.at("ok").boolean());
    EXPECT_THAT(result.at("worst").string(), HasSubstr(row.words));
    core::write_file(file, right);
  }
}

TEST(EurocFlight, BelievedCalibrationsAndClocksHold) {
  const ScratchFolder scratch;
  make_dataset(
      scratch / "job",
      "errors = {focal_length_sd_px = 0.3, azimuth_sd_deg = 0.2, offset_sd_mm = [2.0, 2.0, 2.0], "
      "clock_offset_sd_s = 1e-3}",
      "believed");
  for (const char* name : {"structure", "clocks", "calibration_position"})
    EXPECT_TRUE(result_in(scratch / "job/out/report/euroc", name).at("ok").boolean()) << name;
}

TEST(EurocFlight, WrongFilesAreFoundAndNamed) {
  struct Row {
    const char* file;
    std::function<std::string(const std::string&)> change;
    const char* words;
  };
  const std::vector<std::size_t> xyzw = {0, 1, 2, 3, 5, 6, 7, 4};
  const auto stamps_in = [](std::size_t num_digits) {
    return [num_digits](const std::string& text) {
      return with_lines(text, [num_digits](const std::string& line) {
        const std::size_t comma = line.find(',');
        return line.substr(0, comma - num_digits) + line.substr(comma);
      });
    };
  };
  const auto rows = [](auto change) {
    return [change](const std::string& text) { return with_lines(text, change); };
  };
  const auto replace = [](const std::string& from, const std::string& to) {
    return [from, to](std::string text) {
      const std::size_t at = text.find(from);
      EXPECT_NE(at, std::string::npos) << from;
      return at == std::string::npos ? text : text.replace(at, from.size(), to);
    };
  };
  // T_BS of the left camera, turned round by hand: its rotation transposed, its place by it and negated.
  const auto inverted = [](const std::string& text) {
    const std::size_t from = text.find('['), to = text.find(']');
    std::string list = text.substr(from + 1, to - from - 1);
    std::replace(list.begin(), list.end(), ',', ' ');
    std::istringstream cells(list);
    double m[16];
    for (double& value : m) cells >> value;
    std::string inverse;
    for (int i = 0; i < 3; ++i) {
      double t = 0.0;
      for (int k = 0; k < 3; ++k) {
        inverse += fmt::format("{:.17g}, ", m[4 * k + i]);
        t -= m[4 * k + i] * m[4 * k + 3];
      }
      inverse += fmt::format("{:.17g}, ", t);
    }
    return text.substr(0, from + 1) + inverse + "0, 0, 0, 1" + text.substr(to);
  };
  const std::string truth = "mav0/state_groundtruth_estimate0/data.csv", imu = "mav0/imu0/data.csv",
                    camera = "mav0/cam0/sensor.yaml";
  const std::vector<Row> wrong = {
      {truth.c_str(), rows(in_order(xyzw)), "quaternions stand as x y z w"},
      {truth.c_str(), rows(in_order({0, 1, 2, 3, 4, 5, 6, 7, 11, 12, 13, 8, 9, 10})),
       "velocities are"},
      {truth.c_str(), rows(in_order({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 14, 15, 16, 11, 12, 13})),
       "biases"},
      {imu.c_str(), rows(in_order({0, 4, 5, 6, 1, 2, 3})), "forces stand before turn rates"},
      {imu.c_str(), stamps_in(3), "stamps are in microseconds"},
      {"mav0/imu1/data.csv", stamps_in(9), "stamp that is not after"},
      {"mav0/imu0/sensor.yaml",
       replace("gyroscope_noise_density: 0.000187", "gyroscope_noise_density: 0.0107"),
       "gyroscope_noise_density = 0.0107"},
      {"kalibr/imu.yaml", replace("update_rate: 200.0", "update_rate: 100.0"), "update_rate = 100"},
      {"kalibr/camchain-imucam.yaml", replace("T_cam_imu", "T_imu_cam"), "no key cam0.T_cam_imu"},
      {"openvins/kalibr_imucam_chain.yaml", replace("45.5", "45.0"), "other intrinsics"},
      {camera.c_str(), inverted, "T_BS takes points of the body into the camera, the inverse"},
      {camera.c_str(), replace("-0.28", "0.28"), "other intrinsics"},
      {camera.c_str(), replace("rate_hz: 15.0", "rate_hz: 30.0"), "rate_hz = 30"},
      {"mav0/cam0/data.csv", stamps_in(6), "cam0/data.csv"}};
  const ScratchFolder scratch;
  const fs::path dataset = make_dataset(scratch / "job");
  for (const Row& row : wrong) {
    SCOPED_TRACE(std::string(row.file) + ": " + row.words);
    const fs::path file = dataset / "P000" / row.file;
    const std::string right = core::read_text_file(file);
    core::write_file(file, row.change(right));
    list_files_again(dataset);
    const ProgramResult validated = run_program(
        {"validate", dataset.string(), "--report", (scratch / "report").string(), "--quiet"});
    EXPECT_EQ(validated.status, 1) << validated.output;
    EXPECT_THAT(result_in(scratch / "report", "structure").at("worst").string(),
                HasSubstr(row.words));
    core::write_file(file, right);
  }
  // Images of another time: by the truth's rows all cameras stand elsewhere.
  const fs::path file = dataset / "P000/mav0/cam1/data.csv";
  core::write_file(file, "#timestamp [ns],filename\n");
  list_files_again(dataset);
  EXPECT_EQ(run_program({"validate", dataset.string(), "--report", (scratch / "report").string(),
                         "--quiet"})
                .status,
            1);
}

}  // namespace
}  // namespace terracast::test
