// EuRoC's layout: stamps, names, rows and yaml files, and what OpenCV's reader makes of them.

#include <opencv2/core.hpp>
#include <sstream>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "export/euroc_files.h"
#include "export/utc_stamps.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using Eigen::Vector3d;
using testing::HasSubstr;

TinyCaptureOptions small() {
  TinyCaptureOptions options;
  options.num_frames = 3;
  options.has_tartan2 = false;
  return options;
}

std::vector<std::string> lines_of(const fs::path& file) {
  std::istringstream text(core::read_text_file(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

struct Euroc : testing::Test {
  ScratchFolder scratch;

  fs::path run(const TinyCaptureOptions& options, const std::string& keys = "") {
    write_tiny_capture(scratch / "capture", options);
    run_export(scratch / "capture", "format = \"euroc\"\n" + keys, scratch / "out");
    return scratch / "out/euroc/valley";
  }
};

TEST_F(Euroc, StampsAreWholeNanosecondsSince1970) {
  // By way of a double of seconds they would come out as …123456768.
  EXPECT_EQ(exporters::unix_nanoseconds("2025-06-21T10:00:00.123456789Z", 0.0),
            1'750'500'000'123'456'789);
  EXPECT_EQ(exporters::unix_nanoseconds("2025-06-21T10:00:00Z", 1.0 / 3.0),
            1'750'500'000'333'333'333);
  EXPECT_EQ(exporters::unix_nanoseconds("1969-12-31T23:59:59Z", 0.25), -750'000'000);
  EXPECT_EQ(exporters::seconds_with_nanoseconds(1'750'500'000'000'000'007), "1750500000.000000007");
  EXPECT_EQ(exporters::seconds_with_nanoseconds(-750'000'000), "-0.750000000");
}

TEST_F(Euroc, CamerasOfOneFrameHaveTheSameNames) {
  const fs::path folder = run(small());
  const capture::SequenceInfo info = tiny_sequence(small());
  const std::int64_t start_ns = exporters::unix_nanoseconds(info.utc_start, 0.0);
  for (std::size_t k = 0; k < info.cameras.size(); ++k) {
    const fs::path camera = folder / "mav0" / fmt::format("cam{}", k);
    const std::vector<std::string> rows = lines_of(camera / "data.csv");
    ASSERT_EQ(rows.size(), 4U);
    EXPECT_EQ(rows[0], "#timestamp [ns],filename");
    for (std::size_t f = 0; f < 3; ++f) {
      const std::int64_t stamp_ns = start_ns + static_cast<std::int64_t>(f) * 100'000'000;
      EXPECT_EQ(rows[f + 1], fmt::format("{0},{0}.png", stamp_ns));
      const auto image = core::decode_png(
          core::read_file(camera / "data" / fmt::format("{}.png", stamp_ns)), "image");
      EXPECT_EQ(std::get<core::Image8>(image).channels(), 1);
      EXPECT_TRUE(
          fs::exists(folder / "range" / fmt::format("cam{}", k) / fmt::format("{}.npy", stamp_ns)));
    }
  }
  EXPECT_FALSE(fs::exists(folder / "mav0/imu0"));
  EXPECT_FALSE(fs::exists(folder / "openvins"));
  EXPECT_TRUE(fs::exists(folder / "kalibr/camchain.yaml"));
}

TEST_F(Euroc, WithoutAnImuTheTruthIsTheBodys) {
  const fs::path folder = run(small());
  const std::vector<std::string> rows =
      lines_of(folder / "mav0/state_groundtruth_estimate0/data.csv");
  ASSERT_EQ(rows.size(), 4U);
  // Between two frames the rotation in R is that of the flight, whatever R's axes are.
  std::vector<Eigen::Quaterniond> attitudes;
  std::vector<Vector3d> places;
  for (std::size_t f = 1; f < rows.size(); ++f) {
    std::vector<double> cells;
    std::istringstream row(rows[f]);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(std::stod(cell));
    ASSERT_EQ(cells.size(), 17U);
    places.emplace_back(cells[1], cells[2], cells[3]);
    attitudes.emplace_back(cells[4], cells[5], cells[6], cells[7]);
    for (std::size_t i = 11; i < 17; ++i) EXPECT_EQ(cells[i], 0.0);
  }
  const geo::Rigid3d first = tiny_world_from_body(small(), 0),
                     last = tiny_world_from_body(small(), 2);
  EXPECT_LT((attitudes[0].conjugate() * attitudes[2])
                .angularDistance(first.rotation.conjugate() * last.rotation),
            1e-12);
  EXPECT_LT((attitudes[0].conjugate() * (places[2] - places[0]) -
             first.rotation.conjugate() * (last.translation - first.translation))
                .norm(),
            1e-7);
  EXPECT_THAT(core::read_text_file(folder / "mav0/state_groundtruth_estimate0/sensor.yaml"),
              HasSubstr("there is no IMU"));
}

TEST_F(Euroc, ColorAndRangesAreChosen) {
  const fs::path folder = run(small(), "images = \"color\"\nrange = false\n");
  EXPECT_FALSE(fs::exists(folder / "range"));
  const std::string name = lines_of(folder / "mav0/cam0/data.csv")[1].substr(20);
  const auto image = core::decode_png(core::read_file(folder / "mav0/cam0/data" / name), "image");
  EXPECT_EQ(std::get<core::Image8>(image).channels(), 3);
}

TEST_F(Euroc, BelievedClocksNameImages) {
  TinyCaptureOptions options = small();
  options.has_clock_errors = true;
  const fs::path folder = run(options, "calibration = \"believed\"\n");
  const std::int64_t start_ns = exporters::unix_nanoseconds(tiny_sequence(options).utc_start, 0.0);
  const std::vector<std::string> rows = lines_of(folder / "mav0/cam1/data.csv");
  for (std::size_t f = 0; f < 3; ++f)
    EXPECT_EQ(std::stoll(rows[f + 1]),
              start_ns + std::llround(1e9 * tiny_stamp_s(1, 0.1 * static_cast<double>(f))));
  // The truth is of the times at which they were taken.
  EXPECT_EQ(std::stoll(lines_of(folder / "mav0/state_groundtruth_estimate0/data.csv")[2]),
            start_ns + 100'000'000);
}

TEST_F(Euroc, OtherModelsAreRefusedWithAWayOut) {
  auto cameras = tiny_sequence(small()).cameras;
  for (const char* model : {"pinhole", "simple_radial", "radial", "opencv", "opencv_fisheye"}) {
    cameras[0].intrinsics.model = model;
    EXPECT_NO_THROW(export_options("format = \"euroc\"").exporter().check(cameras));
  }
  cameras[0].intrinsics.model = "double_sphere";
  expect_error(ErrorKind::Config,
               {"euroc", "mcs4/cam0", "double_sphere", "opencv_fisheye", "terracast rig export"},
               [&] { export_options("format = \"euroc\"").exporter().check(cameras); });
}

TEST(EurocFiles, DensitiesAreTheConfigsAndTheRestIsTold) {
  const exporters::ImuBelief belief = exporters::imu_belief(
      "sampling = \"instant\"\n\n[gyroscope]\nnoise_radps_per_sqrt_hz = 0.000187\n"
      "walk_radps_per_s_per_sqrt_hz = 2.66e-05\nmarkov_s = 100.0\nturn_on_radps = 0.01\n\n"
      "[accelerometer]\nnoise_mps2_per_sqrt_hz = 0.00186\nwalk_mps2_per_s_per_sqrt_hz = "
      "0.000433\nmarkov_mps2 = 0.0\n");
  EXPECT_EQ(belief.gyro_noise_radps_per_sqrt_hz, 1.87e-4);
  EXPECT_EQ(belief.gyro_walk_radps2_per_sqrt_hz, 2.66e-5);
  EXPECT_EQ(belief.accel_noise_mps2_per_sqrt_hz, 1.86e-3);
  EXPECT_EQ(belief.accel_walk_mps3_per_sqrt_hz, 4.33e-4);
  EXPECT_THAT(belief.others, testing::ElementsAre("gyroscope.turn_on_radps = 0.01"));
}

TEST(EurocFiles, OpenCvReadsWhatOpenVinsReads) {
  exporters::ImuStream imu;
  imu.info.rate_hz = 200.0;
  imu.info.settings_toml =
      "[gyroscope]\nnoise_radps_per_sqrt_hz = 1e-05\nwalk_radps_per_s_per_sqrt_hz = 0.0\n"
      "[accelerometer]\nnoise_mps2_per_sqrt_hz = 2.0\nwalk_mps2_per_s_per_sqrt_hz = 0.003\n";
  const ScratchFolder scratch;
  core::write_file(scratch / "imu.yaml", exporters::openvins_imu(imu));
  cv::FileStorage file((scratch / "imu.yaml").string(), cv::FileStorage::READ);
  ASSERT_TRUE(file.isOpened());
  EXPECT_EQ(static_cast<double>(file["imu0"]["update_rate"]), 200.0);
  EXPECT_EQ(static_cast<double>(file["imu0"]["gyroscope_noise_density"]), 1e-5);
  EXPECT_EQ(static_cast<double>(file["imu0"]["accelerometer_noise_density"]), 2.0);
  EXPECT_EQ(static_cast<double>(file["imu0"]["Tw"][1][1]), 1.0);
  EXPECT_EQ(static_cast<double>(file["imu0"]["Tg"][1][1]), 0.0);

  const geo::Rigid3d imu_from_camera{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d(1.0, 2.0, -0.5).normalized())),
      {0.1, -0.02, 320.0}};
  core::write_file(
      scratch / "chain.yaml",
      exporters::openvins_chain({{"left",
                                  {.model = "opencv",
                                   .width_px = 752,
                                   .height_px = 480,
                                   .parameters = {458.0, 457.0, 367.5, 248.875, -0.28, 1e-5, 0, 0}},
                                  imu_from_camera}},
                                0.0125));
  cv::FileStorage chain((scratch / "chain.yaml").string(), cv::FileStorage::READ);
  ASSERT_TRUE(chain.isOpened());
  const cv::FileNode camera = chain["cam0"];
  EXPECT_EQ(static_cast<std::string>(camera["distortion_model"]), "radtan");
  EXPECT_TRUE(camera["intrinsics"][0].isReal());  // Kalibr takes no integers
  EXPECT_EQ(static_cast<double>(camera["intrinsics"][2]), 367.0);
  EXPECT_EQ(static_cast<double>(camera["distortion_coeffs"][1]), 1e-5);
  EXPECT_EQ(static_cast<int>(camera["resolution"][0]), 752);
  EXPECT_EQ(static_cast<double>(camera["timeshift_cam_imu"]), 0.0125);
  for (int row = 0; row < 3; ++row)
    EXPECT_EQ(static_cast<double>(camera["T_imu_cam"][row][3]), imu_from_camera.translation[row]);
  EXPECT_EQ(static_cast<double>(camera["T_imu_cam"][0][1]),
            imu_from_camera.rotation.toRotationMatrix()(0, 1));
}

}  // namespace
}  // namespace terracast::test
