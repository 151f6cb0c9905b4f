#include <gtest/gtest.h>

#include "rigs/rig_file.h"
#include "tests/rigs/lens_formulas.h"
#include "tests/rigs/shipped_rigs.h"
#include "tests/support/expect_error.h"

// rig_config.json as the versions of COLMAP have it.
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using test::expect_error;
namespace fs = std::filesystem;

constexpr const char* kCameras =
    "# Camera list with one line of data per camera:\n1 PINHOLE 640 480 500.0 500.0 320.0 240.0\n"
    "2 PINHOLE 640 480 800.0 800.0 310.0 250.0\n";

ImportedRig read_config(const fs::path& folder, const std::string& config,
                        const std::string& cameras = kCameras) {
  core::write_file(folder / "cameras.txt", cameras);
  core::write_file(folder / "rig_config.json", config);
  return core::find_registered(rig_formats(), "format", "colmap").read(folder, {});
}

/// The focal length of a camera and where it is.
void expect_camera(const capture::CameraCalibration& camera, const char* name, double fx_px,
                   const Eigen::Vector3d& place_rig) {
  EXPECT_EQ(camera.name, name);
  EXPECT_EQ(camera.intrinsics.parameters[0], fx_px);
  EXPECT_LT((camera.rig_from_camera.translation - place_rig).norm(), 1e-12)
      << camera.rig_from_camera.translation.transpose();
}

/// Up to 3.11 cameras go by their numbers, whatever their order.
TEST(ColmapConfig, CameraIdsNameLinesAndTheReference) {
  const fs::path folder = test_folder("colmap_ids");
  const std::string poses[] = {
      R"("cam_from_rig_rotation": [1, 0, 0, 0], "cam_from_rig_translation": [-0.25, 0, 0])",
      R"("rel_qvec": [1, 0, 0, 0], "rel_tvec": [-0.25, 0, 0])"};
  for (const std::string& pose : poses) {
    SCOPED_TRACE(pose);
    const ImportedRig read = read_config(folder, R"([{"ref_camera_id": 2, "cameras": [
      {"camera_id": 2, "image_prefix": "rig/tele/"},
      {"camera_id": 1, "image_prefix": "rig/wide/", )" +
                                                     pose + "}]}]");
    const auto cameras = build_cameras({read.rig});
    ASSERT_EQ(cameras.size(), 2U);
    expect_camera(cameras[0], "tele", 800.0, {0.0, 0.0, 0.0});
    // Its axes have the rig's origin 0.25 m to the left: it is as far to the right.
    expect_camera(cameras[1], "wide", 500.0, {0.0, -0.25, 0.0});
    EXPECT_EQ(read.rig.name, "rig");
    EXPECT_TRUE(lines_not_used(read.ledger).empty());
  }
}

/// Before rigs had a reference sensor, that camera had a pose as well.
TEST(ColmapConfig, TheReferenceMayStandAnywhereInItsRig) {
  const std::string turned = "[0.7071067811865476, 0, 0.7071067811865476, 0]";  // 90 deg about y
  const ImportedRig read =
      read_config(test_folder("colmap_reference"), R"([{"ref_camera_id": 1, "cameras": [
      {"camera_id": 1, "image_prefix": "a", "rel_qvec": )" +
                                                       turned + R"(, "rel_tvec": [0, 0, 0.5]},
      {"camera_id": 2, "image_prefix": "b", "rel_qvec": [1, 0, 0, 0], "rel_tvec": [0, 0, 0]}]}])");
  const auto cameras = build_cameras({read.rig});
  expect_camera(cameras[0], "a", 500.0, {0.0, 0.0, 0.0});
  // b is at the rig's origin, which a has at (0, 0, 0.5) of its axes: half a metre ahead of it.
  expect_camera(cameras[1], "b", 800.0, {0.5, 0.0, 0.0});
  // What b sees ahead is along x of a, to its right: a turn by 90 deg about y takes z to x.
  EXPECT_LT((cameras[1].rig_from_camera.rotation * Eigen::Vector3d::UnitZ() -
             Eigen::Vector3d(0.0, -1.0, 0.0))
                .norm(),
            1e-12);
}

TEST(ColmapConfig, TellsOfLinesThatNoCameraTakes) {
  const ImportedRig read = read_config(
      test_folder("colmap_others"),
      R"([{"ref_camera_id": 2, "cameras": [{"camera_id": 2, "image_prefix": "rig/tele/"}]}])");
  EXPECT_EQ(build_cameras({read.rig}).size(), 1U);
  expect_told(read.ledger, {"cameras.txt: CAMERA_ID", "no camera of the rig"});
}

TEST(ColmapConfig, WhatACameraStatesOfItsOwnGoesFirst) {
  const ImportedRig read = read_config(
      test_folder("colmap_own"),
      R"([{"cameras": [{"image_prefix": "rig/a/", "ref_sensor": true, "camera_model_name":
      "OPENCV", "camera_params": [600, 601, 320.5, 240.5, -0.1, 0.01, 0.001, -0.002]}]}])",
      "1 PINHOLE 640 480 500.0 500.0 320.0 240.0\n");
  const auto cameras = build_cameras({read.rig});
  // COLMAP counts pixels from the first one's corner.
  expect_lens(cameras[0], pinhole_lens({600.0, 601.0, 320.0, 240.0}, {-0.1, 0.01, 0.001, -0.002}));
  EXPECT_EQ(cameras[0].intrinsics.width_px, 640);
  expect_told(read.ledger, {"cameras.txt: MODEL and PARAMS[]", "which COLMAP takes"});
}

TEST(ColmapConfig, AFileOfAnotherNameIsThatFile) {
  const fs::path folder = test_folder("colmap_named");
  read_config(folder, R"([{"cameras": [{"image_prefix": "r/a/", "ref_sensor": true}]}])",
              "1 PINHOLE 64 48 30 30 32 24\n");
  const fs::path other = folder / "cam_rigid_config.json";
  core::write_file(other, R"([{"cameras": [{"image_prefix": "r/other/", "ref_sensor": true}]}])");
  EXPECT_EQ(find_rig_format(other).name, "colmap");
  const ImportedRig read = find_rig_format(other).read(other, {});
  EXPECT_EQ(build_cameras({read.rig})[0].name, "other");
}

TEST(ColmapConfig, NamesWhatIsMissingOrContradicts) {
  const fs::path folder = test_folder("colmap_wrong");
  const auto expect = [&](const std::string& config, const std::vector<std::string>& words) {
    SCOPED_TRACE(config);
    expect_error(ErrorKind::Input, words, [&] { read_config(folder, config); });
  };
  const std::string a = R"({"camera_id": 1, "image_prefix": "r/a/"})";
  const std::string b = R"({"camera_id": 2, "image_prefix": "r/b/"})";
  expect(R"([{"ref_camera_id": 1, "cameras": [)" + a + "," + b + "]}]",
         {"cameras[1]", "rel_qvec and rel_tvec", "nothing says where it is"});
  expect(R"([{"ref_camera_id": 7, "cameras": [)" + a + "]}]", {"ref_camera_id is 7"});
  expect(R"([{"ref_camera_id": 1, "cameras": [)" + a + "," + a + "]}]",
         {"cameras[1]", "camera_id 1 stands twice"});
  expect(R"([{"ref_camera_id": 3, "cameras": [{"camera_id": 3, "image_prefix": "r/a/"}]}])",
         {"cameras[0]", "camera_id 3", "cameras.txt beside it has 1, 2"});
  expect(R"([{"cameras": [)" + a + R"(, {"image_prefix": "r/b/", "ref_sensor": true}]}])",
         {"1 of 2 cameras have a camera_id"});
  expect(R"([{"ref_camera_id": 1, "cameras": [)" + a +
             R"(, {"camera_id": 2, "image_prefix": "r/b/", "ref_sensor": true}]}])",
         {"another camera says ref_sensor"});
  expect(R"([{"cameras": []}, {"cameras": []}])", {"list of one rig", "of several"});
  expect(R"([{"ref_camera_id": 1, "cameras": [{"camera_id": 1, "image_prefix": "a",
      "camera_model_name": "RAD_TAN_THIN_PRISM_FISHEYE", "camera_params": [1]}]}])",
         {"cameras[0]", "RAD_TAN_THIN_PRISM_FISHEYE is not known", "THIN_PRISM_FISHEYE"});
  expect(R"([{"ref_camera_id": 1, "cameras": [{"camera_id": "one", "image_prefix": "a"}]}])",
         {"rig_config.json"});
  fs::remove(folder / "cameras.txt");
  expect_error(ErrorKind::Io, {"cameras.txt", "sizes"},
               [&] { core::find_registered(rig_formats(), "format", "colmap").read(folder, {}); });
  core::write_file(folder / "cameras.bin", "x");
  expect_error(ErrorKind::Input, {"cameras.bin", "model_converter --output_type TXT"},
               [&] { core::find_registered(rig_formats(), "format", "colmap").read(folder, {}); });
}

}  // namespace
}  // namespace terracast::rigs
