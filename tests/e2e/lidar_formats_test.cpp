#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/support/listed_files.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "validate/npy.h"

/// A lidar's points in the files of published formats, through the whole program: they hold, a second reader finds them on
/// the ground, and each mistake is named.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;

/// A climbing flight over trees, and a car.
constexpr const char* kJob = R"(name = "job"
world = {name = "job", origin_lat_deg = 46.0, origin_lon_deg = 7.0, size_m = 512.0, outside = "extend", elevation = [{kind = "plane", vertical_datum = "ellipsoid", height_m = 500.0}], layer = [{name = "cover", kind = "land_cover", source = "derived"}, {name = "trees", kind = "vegetation"}]}
detail.finest_spacing_m = 2.0
trajectories = [{name = "P000", kind = "waypoints", closed = true, speed_mps = 15.0, rate_hz = 10.0, num_frames = 6, waypoints = [{east_m = 0.0, north_m = 0.0, height_m = 40.0, above = "ground"}, {east_m = 60.0, north_m = 20.0, height_m = 70.0, above = "ground"}, {east_m = 40.0, north_m = 70.0, height_m = 30.0, above = "ground"}]}]
conditions.color_samples = 1

[[rigs]]
name = "down"
mount_pitch_deg = 60.0
cameras = [{name = "left", width_px = 96, height_px = 72, fx_px = 60.0}, {name = "right", width_px = 96, height_px = 72, fx_px = 60.0, offset_mm = [0.0, -500.0, 0.0]}]

[[rigs.sensors]]
name = "odd"
kind = "lidar"
rate_hz = 7.0
columns = 16

[[rigs.sensors]]
name = "spin"
kind = "lidar"
rate_hz = 10.0
offset_mm = [300.0, -200.0, 100.0]
euler_deg = [3.0, 10.0, 25.0]
columns = 512

[[moving]]
name = "car"
thing = "hatchback"
ride = "free"
kind = "orbit"
min_agl_m = 0.5
centre = {east_m = 53.0, north_m = -37.0, height_m = 1.0, above = "ground"}
radius_m = 4.0
speed_mps = 8.0

[[exports]]
format = "kitti"
rig = "down"
left = "left"
right = "right"
disparity = "off"
)";

Json result_of(const Json& report, const std::string& name) {
  for (std::size_t i = 0; i < report.at("checks").size(); ++i)
    if (report.at("checks").at(i).at("name").string() == name) return report.at("checks").at(i);
  ADD_FAILURE() << "no result " << name;
  return Json::object();
}

/// Numbers of a binary file, to be edited.
template <class Number>
std::vector<Number> numbers_in(const fs::path& file) {
  const std::vector<std::byte> bytes = core::read_file(file);
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
  return numbers;
}
template <class Number>
void write_numbers(const fs::path& file, const std::vector<Number>& numbers) {
  std::vector<std::byte> bytes(numbers.size() * sizeof(Number));
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  core::write_file(file, bytes);
}

struct LidarFormats : testing::Test {
  static constexpr int kFrames = 6;
  ScratchFolder scratch;
  fs::path out = scratch / "out";

  void run(const std::string& job) {
    core::write_file(scratch / "job.toml", job);
    const ProgramResult result =
        run_program({"run", (scratch / "job.toml").string(), "--out", out.string(), "--quiet"});
    ASSERT_EQ(result.status, 0) << result.output;
  }
  void holds(const std::string& format, const std::vector<std::string>& names) const {
    const Json report = Json::read(out / "report" / format / "report.json");
    for (const std::string& name : names) {
      const Json result = result_of(report, name);
      EXPECT_TRUE(result.at("ok").boolean()) << format << ", " << name;
      EXPECT_FALSE(result.at("skipped").boolean()) << format << ", " << name;
    }
    for (std::size_t i = 0; i < report.at("not_proved").size(); ++i)
      EXPECT_NE(report.at("not_proved").at(i).at("why").string(),
                "a kind of file that no check reads")
          << report.at("not_proved").at(i).at("files").string();
  }
  /// A spoilt copy fails, and the report names one cause whose name is that; or, of damage, its words are in a result.
  void is_named(const std::string& format, const std::string& cause,
                const std::function<void(const fs::path&)>& spoil) const {
    const fs::path dataset = scratch / "spoilt", report_folder = scratch / "spoilt_report";
    fs::remove_all(dataset);
    fs::copy(out / "export" / format, dataset, fs::copy_options::recursive);
    spoil(dataset);
    list_files_again(dataset);
    const ProgramResult validated =
        run_program({"validate", dataset.string(), "--report", report_folder.string(), "--quiet"});
    EXPECT_EQ(validated.status, 1) << cause << ": " << validated.output;
    const Json report = Json::read(report_folder / "report.json");
    std::vector<std::string> named;
    for (std::size_t i = 0; i < report.at("causes").size(); ++i)
      named.push_back(report.at("causes").at(i).at("name").string());
    EXPECT_THAT(named, testing::ElementsAre(cause)) << validated.output;
  }
  /// A spoilt copy fails, and a result says these words.
  void is_found(const std::string& format, const std::string& name, const std::string& words,
                const std::function<void(const fs::path&)>& spoil) const {
    const fs::path dataset = scratch / "spoilt", report_folder = scratch / "spoilt_report";
    fs::remove_all(dataset);
    fs::copy(out / "export" / format, dataset, fs::copy_options::recursive);
    spoil(dataset);
    list_files_again(dataset);
    const ProgramResult validated =
        run_program({"validate", dataset.string(), "--report", report_folder.string(), "--quiet"});
    EXPECT_EQ(validated.status, 1) << words << ": " << validated.output;
    const Json result = result_of(Json::read(report_folder / "report.json"), name);
    EXPECT_FALSE(result.at("ok").boolean()) << words;
    EXPECT_THAT(result.at("worst").string(), testing::HasSubstr(words));
  }
  Json read(const std::vector<std::string>& words) const {
    std::vector<std::string> all = {TERRACAST_SOURCE_DIR "/tests/e2e/scan_reader.py"};
    all.insert(all.end(), words.begin(), words.end());
    const ProgramResult result = run_command("python3", all);
    EXPECT_EQ(result.status, 0) << result.output;
    return Json::parse(result.output, "scan_reader.py");
  }
};

/// x, y, z of the rows of a sequence's scans whose times are nearest to a frame's, as their own sensor had them.
std::vector<float> skewed_points(const fs::path& scans, int frame, double rate_hz) {
  std::vector<float> numbers;
  for (int file = std::max(0, frame - 1); file <= frame; ++file) {
    const fs::path path = scans / fmt::format("{:06}.npy", file);
    const validate::NpyTable table =
        validate::parse_npy_table(core::read_file(path), path.string());
    const std::vector<double> time_s = table.numbers("time_s", "");
    std::vector<std::vector<double>> columns;
    for (const char* name : {"x_m", "y_m", "z_m", "reflectance"})
      columns.push_back(table.numbers(name, ""));
    for (std::size_t row = 0; row < time_s.size(); ++row)
      if (std::floor(time_s[row] * rate_hz + 0.5) == frame)
        for (const std::vector<double>& column : columns)
          numbers.push_back(static_cast<float>(column[row]));
  }
  return numbers;
}

TEST_F(LidarFormats, KittiHoldsAndMistakesAreNamed) {
  run(kJob);
  if (HasFatalFailure()) return;
  holds("kitti", {"lidar_files", "lidar_files_place", "lidar_files_depth"});
  const std::string path = "dataset/sequences/00";
  const auto each = [&](const fs::path& dataset, const char* folder, const char* form,
                        const std::function<void(const fs::path&, int)>& change) {
    for (int frame = 0; frame < kFrames; ++frame)
      change(dataset / path / folder / fmt::format("{:06}.{}", frame, form), frame);
  };
  const auto edit_points = [&](const std::function<void(float*)>& change) {
    return [=](const fs::path& dataset) {
      each(dataset, "velodyne", "bin", [&](const fs::path& file, int) {
        std::vector<float> numbers = numbers_in<float>(file);
        for (std::size_t i = 0; i < numbers.size(); i += 4) change(&numbers[i]);
        write_numbers(file, numbers);
      });
    };
  };
  is_named("kitti", "lidar_not_deskewed", [&](const fs::path& dataset) {
    each(dataset, "velodyne", "bin", [&](const fs::path& file, int frame) {
      write_numbers(file, skewed_points(dataset / path / "sensors/down/spin", frame, 10.0));
    });
  });
  is_named("kitti", "lidar_axes", edit_points([](float* p) {
             const float forward = p[0];
             p[0] = -p[1];
             p[1] = forward;
           }));
  is_named("kitti", "lidar_reflectance_dropped", edit_points([](float* p) { p[3] = 0.0F; }));
  is_named("kitti", "lidar_reflectance_unit", edit_points([](float* p) { p[3] *= 255.0F; }));
  is_named("kitti", "lidar_float64", [&](const fs::path& dataset) {
    each(dataset, "velodyne", "bin", [&](const fs::path& file, int) {
      const std::vector<float> numbers = numbers_in<float>(file);
      write_numbers(file, std::vector<double>(numbers.begin(), numbers.end()));
    });
  });
  is_named("kitti", "lidar_points_of_other_scan", [&](const fs::path& dataset) {
    each(dataset, "velodyne", "bin", [&](const fs::path& file, int frame) {
      if (frame < kFrames - 1)
        fs::copy_file(file.parent_path() / fmt::format("{:06}.bin", frame + 1), file,
                      fs::copy_options::overwrite_existing);
    });
  });
  is_named("kitti", "lidar_labels_of_other_scan", [&](const fs::path& dataset) {
    each(dataset, "labels", "label", [&](const fs::path& file, int frame) {
      if (frame < kFrames - 1)
        fs::copy_file(file.parent_path() / fmt::format("{:06}.label", frame + 1), file,
                      fs::copy_options::overwrite_existing);
    });
  });
  is_named("kitti", "lidar_labels_halves", [&](const fs::path& dataset) {
    each(dataset, "labels", "label", [&](const fs::path& file, int) {
      std::vector<std::uint32_t> labels = numbers_in<std::uint32_t>(file);
      for (std::uint32_t& label : labels) label = label << 16 | label >> 16;
      write_numbers(file, labels);
    });
  });
  const auto edit_mount =
      [&](const std::function<Eigen::Matrix4d(const Eigen::Matrix4d&)>& change) {
        return [=](const fs::path& dataset) {
          const fs::path file = dataset / path / "calib.txt";
          std::string text = core::read_text_file(file);
          const std::size_t at = text.find("Tr: ");
          std::istringstream words(text.substr(at + 4));
          Eigen::Matrix4d mount = Eigen::Matrix4d::Identity();
          for (int i = 0; i < 12; ++i) words >> mount(i / 4, i % 4);
          mount = change(mount);
          text.resize(at);
          text += "Tr:";
          for (int i = 0; i < 12; ++i) text += fmt::format(" {:.12e}", mount(i / 4, i % 4));
          core::write_file(file, text + "\n");
        };
      };
  is_named(
      "kitti", "lidar_mount_inverted",
      edit_mount([](const Eigen::Matrix4d& mount) -> Eigen::Matrix4d { return mount.inverse(); }));
  is_named("kitti", "lidar_mount_axes",
           edit_mount([](const Eigen::Matrix4d& mount) -> Eigen::Matrix4d {
             Eigen::Matrix4d axes = Eigen::Matrix4d::Identity();
             axes.topLeftCorner<2, 2>() << 0.0, -1.0, 1.0, 0.0;
             return mount * axes;
           }));
  is_named("kitti", "lidar_mount_moved", edit_mount([](Eigen::Matrix4d mount) -> Eigen::Matrix4d {
             mount(0, 3) += 0.05;
             return mount;
           }));
  // What has no name is found all the same.
  is_found("kitti", "lidar_files", "velodyne/000002.bin", [&](const fs::path& dataset) {
    fs::resize_file(dataset / path / "velodyne/000002.bin", 1003);
  });
  is_found("kitti", "lidar_files", "not finite", [&](const fs::path& dataset) {
    const fs::path file = dataset / path / "velodyne/000002.bin";
    std::vector<float> numbers = numbers_in<float>(file);
    numbers[5] = std::numeric_limits<float>::quiet_NaN();
    write_numbers(file, numbers);
  });
  is_found("kitti", "lidar_files", "which SemanticKITTI has not", [&](const fs::path& dataset) {
    const fs::path file = dataset / path / "labels/000002.label";
    std::vector<std::uint32_t> labels = numbers_in<std::uint32_t>(file);
    labels[5] = 12;
    write_numbers(file, labels);
  });
  is_found("kitti", "lidar_files_place", "000003.bin, point 7", [&](const fs::path& dataset) {
    const fs::path file = dataset / path / "velodyne/000003.bin";
    std::vector<float> numbers = numbers_in<float>(file);
    numbers[28] += 0.001F;
    write_numbers(file, numbers);
  });
  is_found("kitti", "structure", "other poses", [&](const fs::path& dataset) {
    const fs::path file = dataset / path / "poses.txt";
    core::write_file(file, core::read_text_file(file) + "\n");
  });
  is_found("kitti", "structure", "names no lidar", [&](const fs::path& dataset) {
    std::string text = core::read_text_file(dataset / "dataset.json");
    const std::size_t at = text.find("\"lidar\"");
    text.replace(at, 7, "\"other\"");
    core::write_file(dataset / "dataset.json", text);
  });
}

TEST_F(LidarFormats, ASecondReaderFindsKittisPointsOnTheGround) {
  if (run_command("python3", {"--version"}).status != 0) GTEST_SKIP() << "no python3";
  run(kJob);
  if (HasFatalFailure()) return;
  const fs::path dataset = out / "export/kitti/dataset";
  const Json found = read({"kitti", (dataset / "sequences/00").string(),
                           (dataset / "sequences/00/poses.txt").string()});
  EXPECT_EQ(found.at("num_poses").integer(), kFrames);
  ASSERT_EQ(found.at("frames").size(), static_cast<std::size_t>(kFrames));
  std::int64_t num_points = 0;
  bool has_car = false, has_trees = false;
  for (std::size_t i = 0; i < found.at("frames").size(); ++i) {
    const Json& frame = found.at("frames").at(i);
    num_points += frame.at("num_points").integer();
    // A turn of 512 columns of 16 lasers, of which many look into the sky; the first one is a half.
    EXPECT_GT(frame.at("num_points").integer(), i == 0 ? 1000 : 2000);
    EXPECT_LE(frame.at("num_points").integer(), 512 * 16);
    // The ground's lattice is of 2^-10 m, its triangles are 2 m wide; float32 leaves 8e-6 m of 100 m.
    EXPECT_NEAR(frame.at("lowest_m").number(), 500.0, 2e-3) << i;
    EXPECT_NEAR(frame.at("highest_m").number(), 500.0, 2e-3) << i;
    EXPECT_GT(frame.at("most_reflectance").number(), 0.0);
    EXPECT_LE(frame.at("most_reflectance").number(), 1.0);
    has_car = has_car || frame.at("labels").has("252");
    has_trees = has_trees || frame.at("labels").has("70");
    // The one car has the one instance of its class.
    for (std::size_t k = 0; k < frame.at("instances").size(); ++k) {
      EXPECT_EQ(frame.at("instances").at(k).at(0).integer(), 252);
      EXPECT_EQ(frame.at("instances").at(k).at(1).integer(), 1);
    }
  }
  EXPECT_TRUE(has_car);
  EXPECT_TRUE(has_trees);
  const Json lidar =
      Json::read(out / "export/kitti/dataset.json").at("sequences").at(0).at("lidar");
  EXPECT_EQ(lidar.at("name").string(), "spin");  // not `odd`, whose turns do not follow the frames
  EXPECT_EQ(lidar.at("num_points").integer(), num_points);

  // By its name it is refused.
  const ProgramResult refused = run_program({"export", (scratch / "job.toml").string(), "--out",
                                             out.string(), "--set", "exports.0.lidar=odd"});
  EXPECT_EQ(refused.status, 2) << refused.output;
  EXPECT_THAT(refused.output, testing::HasSubstr("no whole multiple of the frames' 10 Hz"));
  const ProgramResult unknown = run_program({"export", (scratch / "job.toml").string(), "--out",
                                             out.string(), "--set", "exports.0.lidar=spinn"});
  EXPECT_EQ(unknown.status, 2) << unknown.output;
  EXPECT_THAT(unknown.output, testing::HasSubstr("has no lidar spinn; it has odd, spin"));
  // Without it the files are those of a rig that has none.
  ASSERT_EQ(run_program({"export", (scratch / "job.toml").string(), "--out", out.string(), "--set",
                         "exports.0.lidar=off"})
                .status,
            0);
  EXPECT_FALSE(fs::exists(dataset / "sequences/00/velodyne"));
  EXPECT_FALSE(fs::exists(dataset / "sequences/00/poses.txt"));
  EXPECT_THAT(core::read_text_file(dataset / "sequences/00/calib.txt"),
              testing::HasSubstr("Tr: 0.000000000000e+00 -1.000000000000e+00"));
}

/// The same flight with TartanAir's cameras and two IMUs, the first off the body's middle.
std::string sensors_job() {
  std::string job = kJob;
  const auto replace = [&](const std::string& from, const std::string& to) {
    const std::size_t at = job.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    job.replace(at, from.size(), to);
  };
  replace(
      "cameras = [{name = \"left\", width_px = 96, height_px = 72, fx_px = 60.0}, {name = "
      "\"right\", width_px = 96, height_px = 72, fx_px = 60.0, offset_mm = [0.0, -500.0, 0.0]}]",
      "cameras = [{name = \"left\", width_px = 640, height_px = 640, fx_px = 320.0}, {name = "
      "\"right\", width_px = 640, height_px = 640, fx_px = 320.0, offset_mm = [0.0, -250.0, "
      "0.0]}]");
  replace("[[moving]]", R"([[rigs.sensors]]
name = "arm"
kind = "imu"
rate_hz = 100.0
offset_mm = [300.0, -200.0, 100.0]
euler_deg = [30.0, 10.0, 180.0]

[[rigs.sensors]]
name = "eye"
kind = "imu"
rate_hz = 200.0
euler_deg = [0.0, 20.0, 0.0]

[[moving]])");
  replace("format = \"kitti\"", "format = \"kitti_raw\"");
  replace("disparity = \"off\"\n", R"(
[[exports]]
format = "tartanair"
rig = "down"
left = "left"
right = "right"
environment = "Hills"
)");
  return job;
}

TEST_F(LidarFormats, RawScansAndImusHoldAndMistakesAreNamed) {
  run(sensors_job());
  if (HasFatalFailure()) return;
  holds("kitti_raw", {"lidar_files", "lidar_files_place", "imu_files"});
  holds("tartanair", {"lidar_files", "lidar_files_place", "lidar_files_depth", "imu_files"});

  const fs::path raw = out / "export/kitti_raw";
  std::string date;
  for (const fs::directory_entry& entry : fs::directory_iterator(raw))
    if (entry.is_directory()) date = entry.path().filename().string();
  const std::string drive = date + "/" + date + "_drive_0001_sync";
  const std::string extract = date + "/" + date + "_drive_0001_extract/oxts";
  const auto each_scan = [&](const fs::path& dataset,
                             const std::function<void(const fs::path&, int)>& change) {
    for (int frame = 0; frame < kFrames; ++frame)
      change(dataset / drive / fmt::format("velodyne_points/data/{:010}.bin", frame), frame);
  };
  is_named("kitti_raw", "lidar_axes", [&](const fs::path& dataset) {
    each_scan(dataset, [](const fs::path& file, int) {
      std::vector<float> numbers = numbers_in<float>(file);
      for (std::size_t i = 0; i < numbers.size(); i += 4) numbers[i + 2] = -numbers[i + 2];
      write_numbers(file, numbers);
    });
  });
  is_found("kitti_raw", "lidar_files", "begins, has its middle and ends",
           [&](const fs::path& dataset) {
             const fs::path folder = dataset / drive / "velodyne_points";
             fs::copy_file(folder / "timestamps.txt", folder / "timestamps_end.txt",
                           fs::copy_options::overwrite_existing);
           });
  is_found("kitti_raw", "imu_files", "its force", [&](const fs::path& dataset) {
    const fs::path file = dataset / extract / "data/0000000007.txt";
    std::string text = core::read_text_file(file);
    std::size_t at = 0;
    for (int blank = 0; blank < 11; ++blank) at = text.find(' ', at) + 1;
    text.replace(at, text.find(' ', at) - at, "0.5");
    core::write_file(file, text);
  });

  const std::string sequence = "Hills/Data_easy/P000";
  is_named("tartanair", "lidar_axes", [&](const fs::path& dataset) {
    for (int frame = 0; frame < kFrames; ++frame) {
      const fs::path file =
          dataset / sequence / fmt::format("lidar/{:06}_lcam_front_lidar.ply", frame);
      std::vector<std::byte> bytes = core::read_file(file);
      const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      for (std::size_t at = text.find("end_header\n") + 11; at < bytes.size(); at += 12)
        for (std::size_t k = 0; k < 4; ++k) std::swap(bytes[at + k], bytes[at + 4 + k]);
      core::write_file(file, bytes);
    }
  });
  is_named("tartanair", "imu_gravity", [&](const fs::path& dataset) {
    // Forces without gravity.
    for (const char* form : {".npy", ".txt"})
      fs::copy_file(dataset / sequence / ("imu/acc_nograv_body" + std::string(form)),
                    dataset / sequence / ("imu/acc" + std::string(form)),
                    fs::copy_options::overwrite_existing);
  });
}

TEST_F(LidarFormats, ASecondReaderFindsRawScansAndImusRight) {
  if (run_command("python3", {"--version"}).status != 0) GTEST_SKIP() << "no python3";
  run(sensors_job());
  if (HasFatalFailure()) return;
  const fs::path raw = out / "export/kitti_raw";
  std::string date;
  for (const fs::directory_entry& entry : fs::directory_iterator(raw))
    if (entry.is_directory()) date = entry.path().filename().string();
  const Json drive = read(
      {"kitti_raw", (raw / date).string(), (raw / date / (date + "_drive_0001_sync")).string()});
  const Json& stamps = drive.at("stamps");
  for (std::size_t i = 0; i < static_cast<std::size_t>(kFrames); ++i) {
    const double middle_s = stamps.at("timestamps").at(i).number();
    EXPECT_NEAR(middle_s - stamps.at("timestamps_start").at(i).number(), i == 0 ? 0.0 : 0.05, 1e-8);
    EXPECT_NEAR(stamps.at("timestamps_end").at(i).number() - middle_s, 0.05, 1e-8);
    EXPECT_GT(drive.at("num_points").at(i).integer(), 1000);
  }
  // 0.5 s at 100 Hz, both ends.
  ASSERT_EQ(drive.at("packets").size(), 51U);
  for (std::size_t i = 0; i < drive.at("packets").size(); ++i) {
    const std::vector<double> packet = drive.at("packets").at(i).numbers();
    EXPECT_NEAR(packet[0], 46.0, 0.01);
    EXPECT_NEAR(std::hypot(packet[8], packet[9], packet[10]), 15.0, 0.5);
    // The force is gravity and what the velocities (to the north, to the east, up) change by; the IMU's lever arm and
    // differences of velocities are good for the rest.
    if (i == 0 || i + 1 == drive.at("packets").size()) continue;
    const std::vector<double> before = drive.at("packets").at(i - 1).numbers();
    const std::vector<double> after = drive.at("packets").at(i + 1).numbers();
    const auto change = [&](std::size_t k) { return (after[k] - before[k]) / 0.02; };
    EXPECT_NEAR(std::hypot(packet[11], packet[12], packet[13]),
                std::hypot(change(6), change(7), change(10) + 9.81), 0.5);
  }

  const Json tartan = read({"tartanair", (out / "export/tartanair/Hills/Data_easy/P000").string()});
  const Json& imu = tartan.at("imu");
  constexpr std::size_t kRows = (kFrames - 1) * 10;
  EXPECT_EQ(imu.at("cam_time").at("type").string(), "<f4");
  EXPECT_EQ(imu.at("acc").at("type").string(), "<f8");
  for (const char* name : {"imu_time", "acc", "gyro", "pos_global", "vel_global", "ori_global",
                           "vel_body", "acc_nograv", "acc_nograv_body"})
    EXPECT_EQ(imu.at(name).at("rows").size(), kRows) << name;
  // Row 10 i is at frame i's pose: tx ty tz qx qy qz qw, camera to north, east, down.
  const auto vector = [&](const char* name, std::size_t row) {
    const std::vector<double> numbers = imu.at(name).at("rows").at(row).numbers();
    return Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
  };
  for (std::size_t frame = 0; frame + 1 < static_cast<std::size_t>(kFrames); ++frame) {
    const std::vector<double> pose = tartan.at("poses").at(frame).numbers();
    const std::size_t row = 10 * frame;
    const Eigen::Matrix3d turned =
        Eigen::Quaterniond(pose[6], pose[3], pose[4], pose[5]).toRotationMatrix();
    EXPECT_LT((vector("pos_global", row) - Eigen::Vector3d(pose[0], pose[1], pose[2])).norm(),
              1e-7);
    const Eigen::Vector3d angles = vector("ori_global", row);
    const Eigen::Matrix3d by_angles = (Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()) *
                                       Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
                                       Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()))
                                          .toRotationMatrix();
    EXPECT_LT((by_angles - turned).norm(), 1e-8);
    EXPECT_LT((vector("acc", row) -
               turned.transpose() * (vector("acc_nograv", row) - Eigen::Vector3d(0.0, 0.0, 9.8)))
                  .norm(),
              1e-8);
  }
  // Velocities and accelerations are the differences of places, to a step's own error.
  const double step_s = 0.01;
  for (std::size_t row = 1; row + 1 < kRows; ++row) {
    const Eigen::Vector3d velocity =
        (vector("pos_global", row + 1) - vector("pos_global", row - 1)) / (2.0 * step_s);
    EXPECT_LT((vector("vel_global", row) - velocity).norm(), 2e-3) << row;
    const Eigen::Vector3d acceleration =
        (vector("vel_global", row + 1) - vector("vel_global", row - 1)) / (2.0 * step_s);
    EXPECT_LT((vector("acc_nograv", row) - acceleration).norm(), 0.05) << row;
  }
}

}  // namespace
}  // namespace terracast::test
