#include "rigs/rig.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>

#include "core/error.h"
#include "core/toml_reader.h"
#include "geo/frames.h"
#include "geo/units.h"

namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using Eigen::Vector3d;

RigOptions shipped_rig(const std::string& name) {
  return core::read_toml<RigOptions>(std::filesystem::path(TERRACAST_SOURCE_DIR) / "configs" /
                                     "rigs" / (name + ".toml"));
}

CameraOptions small_camera(const std::string& name) {
  CameraOptions camera;
  camera.name = name;
  camera.width_px = 64;
  camera.height_px = 48;
  camera.fx_px = 50.0;
  return camera;
}

CameraCalibration only_camera(const RigOptions& rig) { return build_cameras({rig}).at(0); }

/// Direction of the optical axis and of the image's right and lower edge, in the rig.
Vector3d forward_rig(const CameraCalibration& camera) {
  return camera.rig_from_camera.rotation * Vector3d::UnitZ();
}
Vector3d right_rig(const CameraCalibration& camera) {
  return camera.rig_from_camera.rotation * Vector3d::UnitX();
}
Vector3d down_rig(const CameraCalibration& camera) {
  return camera.rig_from_camera.rotation * Vector3d::UnitY();
}

std::string message_of(const std::vector<RigOptions>& rigs) {
  try {
    build_cameras(rigs);
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Config);
    return error.what();
  }
  return "";
}

// Doubles that went through one rotation.
constexpr double kRounding = 1e-12;

TEST(Mcs4, PhysicalOpticsGiveFocalLengthInPixels) {
  // f Nu / d = 20 mm * 720 / 20 mm.
  for (const CameraCalibration& camera : build_cameras({shipped_rig("mcs4")})) {
    EXPECT_EQ(camera.intrinsics.width_px, 720);
    EXPECT_EQ(camera.intrinsics.height_px, 640);
    EXPECT_EQ(camera.intrinsics.parameters, (std::vector<double>{720.0, 720.0, 360.0, 320.0}));
  }
}

TEST(Mcs4, CamerasZeroToTwoStandOnACylinderAndLookOutwards) {
  const auto cameras = build_cameras({shipped_rig("mcs4")});
  ASSERT_EQ(cameras.size(), 4u);
  for (int i = 0; i < 3; ++i) {
    const CameraCalibration& camera = cameras[static_cast<std::size_t>(i)];
    // The table's offsets are rounded to a micrometre, its angles to half a milliradian.
    EXPECT_NEAR(camera.rig_from_camera.translation.norm(), 0.300, 1e-6) << camera.name;
    EXPECT_NEAR(camera.rig_from_camera.translation.z(), 0.0, kRounding);
    const double azimuth = geo::radians_from_degrees(30.0 * i);  // to the right
    const Vector3d outwards(std::cos(azimuth), -std::sin(azimuth), 0.0);
    EXPECT_LT((forward_rig(camera) - outwards).norm(), 5e-4) << camera.name;
    EXPECT_LT((camera.rig_from_camera.translation / 0.3 - outwards).norm(), 1e-5) << camera.name;
    EXPECT_LT((down_rig(camera) + Vector3d::UnitZ()).norm(), kRounding) << camera.name;
  }
  // The rounding of the table is kept: 0.524 rad, not 30 degrees.
  EXPECT_NEAR(std::atan2(-forward_rig(cameras[1]).y(), forward_rig(cameras[1]).x()), 0.524,
              kRounding);
  EXPECT_NEAR(std::atan2(-forward_rig(cameras[2]).y(), forward_rig(cameras[2]).x()), 1.047,
              kRounding);
}

TEST(Mcs4, CamerasZeroAndThreeAreARectifiedPairOfHalfAMetre) {
  const auto cameras = build_cameras({shipped_rig("mcs4")});
  const geo::Rigid3d left_from_right =
      cameras[0].rig_from_camera.inverse() * cameras[3].rig_from_camera;
  EXPECT_LT(left_from_right.rotation.angularDistance(Eigen::Quaterniond::Identity()), kRounding);
  EXPECT_LT((left_from_right.translation - Vector3d(0.5, 0.0, 0.0)).norm(), kRounding);
}

TEST(Tartan2, IsAPairOfAQuarterMetreWithNinetyDegrees) {
  const auto cameras = build_cameras({shipped_rig("tartan2")});
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].name, "lcam_front");
  EXPECT_EQ(cameras[0].intrinsics.parameters, (std::vector<double>{320.0, 320.0, 320.0, 320.0}));
  EXPECT_EQ(cameras[0].rig_from_camera.translation, Vector3d::Zero());
  EXPECT_LT((cameras[1].rig_from_camera.translation - Vector3d(0.0, -0.25, 0.0)).norm(), kRounding);
  const geo::Rigid3d left_from_right =
      cameras[0].rig_from_camera.inverse() * cameras[1].rig_from_camera;
  EXPECT_LT((left_from_right.translation - Vector3d(0.25, 0.0, 0.0)).norm(), kRounding);
}

TEST(Rig, PositiveMountPitchLooksDown) {
  RigOptions rig = shipped_rig("mcs4");
  rig.mount_pitch_deg = 30.0;
  const CameraCalibration camera = only_camera(rig);
  const Vector3d forward_body = camera.body_from_camera().rotation * Vector3d::UnitZ();
  const double pitch = geo::radians_from_degrees(30.0);
  EXPECT_LT((forward_body - Vector3d(std::cos(pitch), 0.0, -std::sin(pitch))).norm(), kRounding);
  // The centre turns with the rig: 0.3 m ahead and down.
  EXPECT_LT((camera.body_from_camera().translation - 0.3 * forward_body).norm(), kRounding);
}

TEST(Rig, OrientationsStateTheSameRotationInTheirOwnWays) {
  // 30 degrees to the right: about "down" in rdf, against "up" in flu.
  const double angle = geo::radians_from_degrees(30.0);
  RigOptions rdf{.name = "rdf",
                 .axes = "rdf",
                 .mount_offset_m = {},
                 .errors = {},
                 .cameras = {small_camera("a")}};
  rdf.cameras[0].axis_angle_rad = {0.0, angle, 0.0};
  RigOptions flu{.name = "flu", .axes = "flu", .mount_offset_m = {}, .errors = {}, .cameras = {}};
  CameraOptions camera = small_camera("axis_angle");
  camera.axis_angle_rad = {0.0, 0.0, -angle};
  flu.cameras.push_back(camera);
  camera = small_camera("euler");
  camera.euler_deg = {-30.0, 0.0, 0.0};
  flu.cameras.push_back(camera);
  camera = small_camera("quaternion");
  camera.quaternion_wxyz = {std::cos(angle / 2), 0.0, 0.0, -std::sin(angle / 2)};
  flu.cameras.push_back(camera);
  camera = small_camera("look_at");
  camera.offset_mm = {10.0, 20.0, 30.0};
  camera.look_at_mm = {10.0 + 1e3 * std::cos(angle), 20.0 - 1e3 * std::sin(angle), 30.0};
  flu.cameras.push_back(camera);
  const Eigen::Quaterniond expected = only_camera(rdf).rig_from_camera.rotation;
  for (const CameraCalibration& made : build_cameras({flu}))
    EXPECT_LT(expected.angularDistance(made.rig_from_camera.rotation), 1e-9) << made.name;
}

TEST(Rig, EulerAnglesTurnIntrinsicallyYawPitchRoll) {
  RigOptions rig{.name = "r",
                 .axes = "flu",
                 .mount_offset_m = {},
                 .errors = {},
                 .cameras = {small_camera("a")}};
  rig.cameras[0].euler_deg = {90.0, 30.0, 0.0};
  // To the left, then 30 degrees down.
  const double c = std::cos(geo::radians_from_degrees(30.0));
  EXPECT_LT((forward_rig(only_camera(rig)) - Vector3d(0.0, c, -0.5)).norm(), kRounding);
  EXPECT_LT((right_rig(only_camera(rig)) - Vector3d(1.0, 0.0, 0.0)).norm(), kRounding);
  rig.cameras[0].euler_deg = {0.0, 0.0, 90.0};  // the right wing goes down
  EXPECT_LT((right_rig(only_camera(rig)) - Vector3d(0.0, 0.0, -1.0)).norm(), kRounding);
}

TEST(Rig, LookAtStraightDownPutsForwardAtTheTop) {
  RigOptions rig{.name = "r",
                 .axes = "flu",
                 .mount_offset_m = {},
                 .errors = {},
                 .cameras = {small_camera("a")}};
  rig.cameras[0].look_at_mm = {0.0, 0.0, -1000.0};
  const CameraCalibration camera = only_camera(rig);
  EXPECT_LT((forward_rig(camera) + Vector3d::UnitZ()).norm(), kRounding);
  EXPECT_LT((down_rig(camera) + Vector3d::UnitX()).norm(), kRounding);
}

TEST(Rig, PixelAspectScalesVerticalFocalLength) {
  RigOptions rig{.name = "r",
                 .axes = "flu",
                 .mount_offset_m = {},
                 .errors = {},
                 .cameras = {small_camera("a")}};
  CameraOptions& camera = rig.cameras[0];
  camera.fx_px = 0.0;
  camera.focal_length_mm = 8.0;
  camera.image_plane_width_mm = 6.4;
  camera.pixel_aspect = 1.25;
  camera.principal_point_px = {30.0, 25.5};
  const std::vector<double> parameters = only_camera(rig).intrinsics.parameters;
  EXPECT_NEAR(parameters[0], 80.0, kRounding);  // 8 * 64 / 6.4
  EXPECT_NEAR(parameters[1], 64.0, kRounding);  // … / 1.25
  EXPECT_EQ(parameters[2], 30.0);
  EXPECT_EQ(parameters[3], 25.5);
}

TEST(Rig, ContradictionsAreRefusedByName) {
  const RigOptions good{.name = "r",
                        .axes = "flu",
                        .mount_offset_m = {},
                        .errors = {},
                        .cameras = {small_camera("a")}};
  EXPECT_NE(message_of({}).find("no rig"), std::string::npos);
  RigOptions rig = good;
  rig.cameras.clear();
  EXPECT_NE(message_of({rig}).find("rig r has no cameras"), std::string::npos);
  rig = good;
  rig.cameras.push_back(small_camera("a"));
  EXPECT_NE(message_of({rig}).find("two cameras are called a"), std::string::npos);
  EXPECT_NE(message_of({good, good}).find("two rigs are called r"), std::string::npos);
  rig = good;
  rig.name = "frames";
  EXPECT_NE(message_of({rig}).find("rig name \"frames\""), std::string::npos);
  rig = good;
  rig.cameras[0].focal_length_mm = 20.0;
  EXPECT_NE(message_of({rig}).find("one way"), std::string::npos);
  rig = good;
  rig.cameras[0].fx_px = 0.0;
  EXPECT_NE(message_of({rig}).find("no focal length"), std::string::npos);
  rig = good;
  rig.cameras[0].euler_deg = {0.0, 0.0, 0.0};
  rig.cameras[0].look_at_mm = {1.0, 0.0, 0.0};
  EXPECT_NE(message_of({rig}).find("2 orientations"), std::string::npos);
  rig = good;
  rig.cameras[0].quaternion_wxyz = {1.0, 1.0, 0.0, 0.0};
  EXPECT_NE(message_of({rig}).find("length"), std::string::npos);
  rig = good;
  rig.cameras[0].offset_mm = {0.0, std::nan(""), 0.0};
  EXPECT_NE(message_of({rig}).find("finite"), std::string::npos);
  rig = good;
  rig.cameras[0].name = "../a";
  EXPECT_NE(message_of({rig}).find("names a folder"), std::string::npos);
  rig = good;
  rig.cameras[0].model = "pinhol";
  EXPECT_NE(message_of({rig}).find("pinhole"), std::string::npos);
  rig = good;
  for (int i = 0; i < 24; ++i) rig.cameras.push_back(small_camera("c" + std::to_string(i)));
  EXPECT_NE(message_of({rig}).find("25 cameras"), std::string::npos);
}

}  // namespace
}  // namespace terracast::rigs
