#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "rigs/rig_file.h"
#include "tests/rigs/lens_formulas.h"
#include "tests/rigs/shipped_rigs.h"
#include "tests/support/expect_error.h"

// Settings of ORB-SLAM2 and ORB-SLAM3, and OpenCV's FileStorage as XML and JSON.
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
using test::expect_error;
namespace fs = std::filesystem;

constexpr Projection kLeft{458.654, 457.296, 367.215, 248.375};
constexpr Projection kRight{457.587, 456.134, 379.999, 255.238};
const std::vector<double> kDistortion{-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};

std::string optics_text(const std::string& camera, const Projection& k) {
  return fmt::format("{0}.fx: {1}\n{0}.fy: {2}\n{0}.cx: {3}\n{0}.cy: {4}\n", camera, k.fx, k.fy,
                     k.cx, k.cy);
}

std::string radtan_text(const std::string& camera) {
  return fmt::format("{0}.k1: {1}\n{0}.k2: {2}\n{0}.p1: {3}\n{0}.p2: {4}\n", camera, kDistortion[0],
                     kDistortion[1], kDistortion[2], kDistortion[3]);
}

/// Of programs before version 1.0.
std::string old_text(const std::string& type = "PinHole") {
  return "%YAML:1.0\n# Camera Parameters. Adjust them!\nCamera.type: \"" + type + "\"\n" +
         optics_text("Camera", kLeft) + radtan_text("Camera") +
         "Camera.width: 752\nCamera.height: 480\nCamera.fps: 20.0\nCamera.RGB: 1\n"
         "ORBextractor.nFeatures: 1000\nViewer.PointSize:2\n";
}

/// Camera axes x right, y down, z forward of a body with x forward, y left, z up, 0.1 m ahead.
constexpr const char* kBodyFromCamera =
    ": !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n"
    "   data:[0, 0, 1, 0.1,\n         -1, 0, 0, 0.2,\n          0, -1, 0, 0.3,\n          0, 0, "
    "0, 1]\n";

std::string stereo_text(const std::string& type = "PinHole") {
  const bool is_fisheye = type == "KannalaBrandt8";
  const auto lens = [&](const std::string& camera) {
    return is_fisheye ? fmt::format(
                            "{0}.k1: 0.0035\n{0}.k2: 0.0007\n{0}.k3: -0.0021\n{0}.k4: "
                            "0.0002\n{0}.overlappingBegin: 0\n",
                            camera)
                      : radtan_text(camera);
  };
  return "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"" + type + "\"\n" +
         optics_text("Camera1", kLeft) + lens("Camera1") + optics_text("Camera2", kRight) +
         lens("Camera2") +
         "Camera.width: 752\nCamera.height: 480\nStereo.ThDepth: 60.0\n"
         "Stereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n  data: [0, -1, 0, "
         "0.11, 1, 0, 0, 0.02, 0, 0, 1, 0.03, 0, 0, 0, 1]\n"
         "IMU.T_b_c1" +
         kBodyFromCamera + "IMU.NoiseGyro: 1.7e-4\n";
}

class OrbSlam : public testing::Test {
 protected:
  std::vector<capture::CameraCalibration> read(const std::string& text) {
    core::write_file(file, text);
    EXPECT_EQ(find_rig_format(file).name, "orb_slam");
    last = read_text("orb_slam", file, text);
    return build_cameras({last.rig});
  }
  const fs::path file = test_folder("orb_slam") / "EuRoC.yaml";
  ImportedRig last;
};

TEST_F(OrbSlam, ACameraShowsPointsWhereItsFormulaDoes) {
  const auto cameras = read(old_text());
  ASSERT_EQ(cameras.size(), 1U);
  expect_lens(cameras[0], pinhole_lens(kLeft, kDistortion));
  // Looks forward: a point ahead of the rig is ahead of the camera.
  EXPECT_LT((cameras[0].rig_from_camera * Vector3d(0, 0, 7) - Vector3d(7, 0, 0)).norm(), 1e-12);
  EXPECT_TRUE(last.ledger.warnings().empty());
  expect_told(last.ledger, {"Camera.fps", "rate_hz"});

  std::vector<double> with_k3 = kDistortion;
  with_k3.push_back(-0.0061);
  expect_lens(read(old_text() + "Camera.k3: -0.0061\n")[0], pinhole_lens(kLeft, with_k3));
  // ORB-SLAM2 has no type.
  std::string untyped = old_text();
  untyped.erase(untyped.find("Camera.type"),
                untyped.find("Camera.fx") - untyped.find("Camera.type"));
  expect_lens(read(untyped)[0], pinhole_lens(kLeft, kDistortion));
}

TEST_F(OrbSlam, TwoCamerasStandWhereTheirMatricesSay) {
  for (const bool is_fisheye : {false, true}) {
    const auto cameras = read(stereo_text(is_fisheye ? "KannalaBrandt8" : "PinHole"));
    ASSERT_EQ(cameras.size(), 2U);
    const auto lens = [&](const Projection& k) {
      return is_fisheye ? equidistant_lens(k, {0.0035, 0.0007, -0.0021, 0.0002})
                        : pinhole_lens(k, kDistortion);
    };
    expect_lens(cameras[0], lens(kLeft));
    expect_lens(cameras[1], lens(kRight));
    // (1, 2, 3) of the second camera is (-2 + 0.11, 1 + 0.02, 3 + 0.03) of the first, and that (z + 0.1, 0.2 - x, 0.3 - y)
    // of the IMU.
    EXPECT_LT((cameras[1].rig_from_camera * Vector3d(1, 2, 3) - Vector3d(3.13, 2.09, -0.72)).norm(),
              1e-12);
    EXPECT_TRUE(last.ledger.warnings().empty());
  }
}

TEST_F(OrbSlam, AnImuIsASensorOfTheRigAtItsOrigin) {
  read(stereo_text());
  EXPECT_TRUE(last.rig.sensors.empty());
  expect_told(last.ledger, {"IMU.NoiseGyro", "no IMU.Frequency"});
  read(stereo_text() +
       "IMU.NoiseAcc: 2.0e-3\nIMU.GyroWalk: 1.9393e-05\nIMU.AccWalk: 3.e-03\n"
       "IMU.Frequency: 200.0\nIMU.InsertKFsWhenLost: 0\n");
  ASSERT_EQ(last.rig.sensors.size(), 1U);
  EXPECT_EQ(last.rig.sensors[0].sensor.kind(), "imu");
  EXPECT_EQ(last.rig.sensors[0].rate_hz, 200.0);
  EXPECT_TRUE(last.rig.sensors[0].offset_mm.empty());
  const std::string toml = rig_toml(last.rig);
  for (const char* line :
       {"noise_radps_per_sqrt_hz = 0.00017\n", "walk_radps_per_s_per_sqrt_hz = 1.9393e-05\n",
        "noise_mps2_per_sqrt_hz = 0.002\n", "walk_mps2_per_s_per_sqrt_hz = 0.003\n"})
    EXPECT_NE(toml.find(line), std::string::npos) << line << toml;
  EXPECT_TRUE(last.ledger.warnings().empty());
}

TEST_F(OrbSlam, ABaselineMakesAPairAndADepthCamerasMakesNone) {
  std::string rectified = "%YAML:1.0\nCamera.type: \"Rectified\"\n" +
                          optics_text("Camera1", kLeft) +
                          "Camera.width: 1241\nCamera.height: 376\nStereo.b: 0.53716\n";
  auto cameras = read(rectified);
  ASSERT_EQ(cameras.size(), 2U);
  expect_lens(cameras[1], pinhole_lens(kLeft, {}));
  EXPECT_LT((cameras[1].rig_from_camera.translation - Vector3d(0, -0.53716, 0)).norm(), 1e-12);

  cameras = read(old_text() + "Camera.bf: 45.8654\n");
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_NEAR(
      (cameras[1].rig_from_camera.translation - cameras[0].rig_from_camera.translation).norm(), 0.1,
      1e-12);
  EXPECT_EQ(read(old_text() + "Camera.bf: 0.0\n").size(), 1U);
  cameras = read(rectified + optics_text("Camera2", kRight));
  EXPECT_LT((cameras.at(1).rig_from_camera.translation - Vector3d(0, -0.53716, 0)).norm(), 1e-12);
  expect_lens(cameras[1], pinhole_lens(kLeft, {}));
  cameras = read(old_text() + "Camera.bf: 40.0\nDepthMapFactor: 5000.0\n");
  EXPECT_EQ(cameras.size(), 1U);
  expect_told(last.ledger, {"Camera.bf", "depth camera"});
  cameras = read(old_text() +
                 "Camera.bf: 45.8654\nLEFT.width: 752\nLEFT.K: !!opencv-matrix\n   rows: "
                 "1\n   cols: 1\n   dt: d\n   data:[458.654]\n");
  EXPECT_EQ(cameras.size(), 2U);
  expect_told(last.ledger, {"LEFT.K", "rectified"});
}

TEST_F(OrbSlam, SaysWhatIsMissingOrUnknown) {
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = old_text();
    return text.replace(text.find(from), from.size(), to);
  };
  expect_error(ErrorKind::Input, {"Scaramuzza", "PinHole, Rectified and KannalaBrandt8"},
               [&] { read(old_text("Scaramuzza")); });
  expect_error(ErrorKind::Input, {"no Camera.width", "add Camera.width and Camera.height"},
               [&] { read(with("Camera.width: 752\n", "")); });
  expect_error(ErrorKind::Input, {"Camera.cy"}, [&] { read(with("Camera.cy", "Camera.sy")); });
  expect_error(ErrorKind::Input, {"Camera.bf = -1", "left out"},
               [&] { read(old_text() + "Camera.bf: -1\n"); });
  std::string alone = stereo_text();
  alone.replace(alone.find("Stereo.T_c1_c2"), 14, "Stereo.T_c2_c1");
  expect_error(ErrorKind::Input, {"Camera2", "no Stereo.T_c1_c2"}, [&] { read(alone); });
}

constexpr const char* kXml = R"(<?xml version="1.0"?>
<opencv_storage>
<calibration_time>"Mon 30 Nov 2026"</calibration_time>
<image_width>752</image_width>
<image_height>480</image_height>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    458.654 0. 367.215 0. 457.296 248.375 0. 0.
    1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix">
  <rows>4</rows>
  <cols>1</cols>
  <dt>d</dt>
  <data>
    -0.28340811 0.07395907 0.00019359 1.76187114e-05</data></distortion_coefficients>
<shutter>"rolling"</shutter>
</opencv_storage>
)";

TEST(OpencvStorage, IsReadAsXmlAndAsJson) {
  const fs::path xml = test_folder("opencv_xml") / "calib.xml";
  core::write_file(xml, std::string(kXml));
  EXPECT_EQ(find_rig_format(xml).name, "opencv");
  const ImportedRig of_xml = read_text("opencv", xml, kXml);
  expect_lens(build_cameras({of_xml.rig}).at(0), pinhole_lens(kLeft, kDistortion));
  expect_told(of_xml.ledger, {"shutter", "not known"});
  expect_told(of_xml.ledger, {"calibration_time"});

  const std::string json =
      R"({"image_width": 752, "image_height": 480, "camera_matrix": {"type_id": "opencv-matrix",
 "rows": 3, "cols": 3, "dt": "d", "data": [458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1]},
 "distortion_coefficients": {"type_id": "opencv-matrix", "rows": 1, "cols": 4, "dt": "d",
 "data": [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]}})";
  const fs::path file = test_folder("opencv_json") / "calib.json";
  core::write_file(file, json);
  EXPECT_EQ(find_rig_format(file).name, "opencv");
  const ImportedRig of_json = read_text("opencv", file, json);
  expect_lens(build_cameras({of_json.rig}).at(0), pinhole_lens(kLeft, kDistortion));
  EXPECT_TRUE(of_json.ledger.warnings().empty());

  // Vectors are elements of several numbers, and maps with cameras are no list of COLMAP's rigs.
  std::string placed = kXml;
  placed.insert(placed.find("<shutter"), "<R>0 -1 0 1 0 0 0 0 1</R>\n<T>-0.2 0. 0.</T>\n");
  EXPECT_LT((build_cameras({read_text("opencv", xml, placed).rig}).at(0).rig_from_camera *
                 Vector3d(0, 0, 0) -
             Vector3d(0, 0, 0.2))
                .norm(),
            1e-12);
  const std::string several = R"({"cameras": [)" + json + "]}";
  core::write_file(file, several);
  EXPECT_EQ(find_rig_format(file).name, "opencv");
  EXPECT_EQ(read_text("opencv", file, several).rig.cameras.size(), 1U);
  // What is another program's is not taken for a damaged calibration.
  for (const char* other : {R"({"a": "\ud83d\ude00"})", "{\"a\": 1, \"a\": 2}"}) {
    core::write_file(file, std::string(other));
    expect_error(ErrorKind::Input, {"neither its name nor its keys"},
                 [&] { find_rig_format(file); });
  }
  const fs::path kml = test_folder("rig_of_kml") / "a.xml";
  core::write_file(kml, std::string("<kml>\n<name>a: b: c</name></kml>"));
  expect_error(ErrorKind::Input, {"neither its name nor its keys"}, [&] { find_rig_format(kml); });

  const auto read = [&](const std::string& text) { read_text("opencv", xml, text); };
  const std::string text = kXml;
  expect_error(ErrorKind::Input, {"no XML"}, [&] { read(text.substr(0, 400)); });
  std::string twice = text;
  twice.insert(twice.find("<shutter"), "<image_width>64</image_width>");
  expect_error(ErrorKind::Input, {"image_width", "twice"}, [&] { read(twice); });
  std::string mixed = text;
  mixed.insert(mixed.find("<dt>"), "<_>1</_>");
  expect_error(ErrorKind::Input, {"camera_matrix", "both items and names"}, [&] { read(mixed); });
  std::string deep = "<opencv_storage>";
  for (int i = 0; i < 1000; ++i) deep += "<a>";
  for (int i = 0; i < 1000; ++i) deep += "</a>";
  expect_error(ErrorKind::Input, {"more than 20 deep"}, [&] { read(deep + "</opencv_storage>"); });
}

}  // namespace
}  // namespace terracast::rigs
