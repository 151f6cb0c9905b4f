// What lies beside a dataset of rigs with errors, and what times formats state.

#include "export/calibration.h"

#include "core/json.h"
#include "core/toml_reader.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;

TinyCaptureOptions small(bool has_camera_errors, bool has_clock_errors) {
  TinyCaptureOptions options;
  options.num_frames = 3;
  options.has_tartan2 = false;
  options.has_camera_errors = has_camera_errors;
  options.has_clock_errors = has_clock_errors;
  return options;
}

struct Calibrations : testing::Test {
  ScratchFolder scratch;

  void run(const TinyCaptureOptions& options, const std::string& toml) {
    write_tiny_capture(scratch / "capture", options);
    run_export(scratch / "capture", toml, scratch / "out");
  }
};

TEST_F(Calibrations, ThereAreNoneWithoutErrors) {
  run(small(false, false), "format = \"colmap\"");
  for (const auto& [file, hash] : file_hashes(scratch / "out")) {
    EXPECT_EQ(file.find("calibration"), std::string::npos) << file;
    EXPECT_EQ(file.find("timestamps"), std::string::npos) << file;
  }
  const Json dataset = Json::read(scratch / "out/colmap/dataset.json");
  EXPECT_FALSE(dataset.at("sequences").at(std::size_t{0}).has("calibration"));
}

TEST_F(Calibrations, HoldBothAndTheClocks) {
  const TinyCaptureOptions options = small(true, true);
  run(options, "format = \"colmap\"");
  const fs::path folder = scratch / "out/colmap/valley";
  const capture::SequenceInfo info = tiny_sequence(options);
  for (const bool is_believed : {false, true}) {
    const Json file =
        Json::read(folder / (is_believed ? "calibration_believed.json" : "calibration_true.json"));
    EXPECT_EQ(file.at("calibration").string(), is_believed ? "believed" : "true");
    const Json& cameras = file.at("cameras");
    ASSERT_EQ(cameras.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
      const capture::CameraCalibration& camera =
          is_believed ? info.believed_cameras[i] : info.cameras[i];
      EXPECT_EQ(cameras.at(i).at("name").string(), "mcs4/" + camera.name);
      EXPECT_EQ(cameras.at(i).at("fx_px").number(), camera.intrinsics.parameters[0]);
      const std::vector<double> place =
          cameras.at(i).at("body_from_camera").at("translation_m").numbers();
      const Eigen::Vector3d center = camera.body_from_camera().translation;
      EXPECT_EQ(place, (std::vector<double>{center.x(), center.y(), center.z()}));
      EXPECT_EQ(cameras.at(i).has("clock"), !is_believed);
    }
  }
  const Json dataset = Json::read(scratch / "out/colmap/dataset.json");
  const Json& sequence = dataset.at("sequences").at(std::size_t{0});
  EXPECT_EQ(sequence.at("calibration_true").string(), "valley/calibration_true.json");
  EXPECT_EQ(sequence.at("calibration_believed").string(), "valley/calibration_believed.json");
  EXPECT_EQ(sequence.at("cameras").at(std::size_t{1}).at("fx_px").number(),
            info.cameras[1].intrinsics.parameters[0]);
  EXPECT_TRUE(slurp(folder / "timestamps.csv")
                  .starts_with("frame,camera,time_s,stamp_s\n"
                               "0,mcs4/cam0,0.000000000,0.010000000\n"
                               "0,mcs4/cam1,0.000000000,0.020000000\n"));
}

TEST_F(Calibrations, KittiRawStatesEachCamerasClock) {
  run(small(false, true), "format = \"kitti_raw\"\ncalibration = \"believed\"");
  const fs::path drive = scratch / "out/kitti_raw/2024_06_21/2024_06_21_drive_0001_sync";
  // Camera 0 of the rig: 0.01 (1 - 0.1 t); camera 3: four times that.
  EXPECT_EQ(slurp(drive / "image_02/timestamps.txt"),
            "2024-06-21 10:00:00.010000000\n2024-06-21 10:00:00.109900000\n"
            "2024-06-21 10:00:00.209800000\n");
  EXPECT_EQ(slurp(drive / "image_01/timestamps.txt"),
            "2024-06-21 10:00:00.040000000\n2024-06-21 10:00:00.139600000\n"
            "2024-06-21 10:00:00.239200000\n");
  EXPECT_EQ(slurp(drive / "oxts/timestamps.txt"),
            "2024-06-21 10:00:00.000000000\n2024-06-21 10:00:00.100000000\n"
            "2024-06-21 10:00:00.200000000\n");
}

TEST_F(Calibrations, KittiStatesTheLeftCamerasClock) {
  const std::string format = "format = \"kitti\"\ndisparity = \"off\"\n";
  run(small(false, true), format + "calibration = \"believed\"");
  const fs::path times = scratch / "out/kitti/dataset/sequences/00/times.txt";
  EXPECT_EQ(slurp(times), "0.000000000e+00\n9.990000000e-02\n1.998000000e-01\n");
  fs::remove_all(scratch / "out");
  run_export(scratch / "capture", format, scratch / "out");
  EXPECT_EQ(slurp(times), "0.000000000e+00\n1.000000000e-01\n2.000000000e-01\n");
}

TEST_F(Calibrations, RectifiedPairsThatAreNoneInTruthAreRefused) {
  write_tiny_capture(scratch / "capture", small(true, false));
  for (const char* calibration : {"true", "believed"})
    expect_error(core::ErrorKind::Config, {"differ in size or intrinsics"}, [&] {
      run_export(scratch / "capture",
                 fmt::format("format = \"kitti\"\ncalibration = \"{}\"", calibration),
                 scratch / "out");
    });
}

TEST_F(Calibrations, CamerasThatMustBeStatedAsTheyAreAreBelievedSoOrRefused) {
  capture::SequenceInfo info = tiny_sequence(small(false, false));
  info.believed_cameras = info.cameras;
  info.believed_cameras[1].rig_from_camera.translation.y() += 0.01;
  exporters::StatedCalibration stated;
  core::TomlDocument::parse("calibration = \"believed\"", "export.toml").read(stated);
  EXPECT_NO_THROW(stated.check_is_true(info, 0, "kitti"));
  expect_error(core::ErrorKind::Config, {"kitti: calibration = \"believed\"", "cam1"},
               [&] { stated.check_is_true(info, 1, "kitti"); });
  EXPECT_NO_THROW(exporters::StatedCalibration().check_is_true(info, 1, "kitti"));
}

}  // namespace
}  // namespace terracast::test
