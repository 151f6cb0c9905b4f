#include "rigs/rig_template.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/error.h"
#include "core/schema_writer.h"
#include "core/toml_reader.h"
#include "geo/units.h"
#include "rigs/rig.h"
#include "tests/support/expect_error.h"

namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using Eigen::Vector3d;
using test::expect_error;

const std::string kCamera =
    "[[cameras]]\nname = \"cam\"\nwidth_px = 64\nheight_px = 48\nfx_px = 50.0\n";

RigOptions rig_from(const std::string& keys, const std::string& cameras = kCamera) {
  RigOptions rig;
  core::TomlDocument::parse("name = \"r\"\n" + keys + "\n" + cameras, "rig.toml").read(rig);
  return rig;
}

std::vector<CameraCalibration> cameras_of(const std::string& keys) {
  return build_cameras({rig_from(keys)});
}

Vector3d axis_of(const CameraCalibration& camera) {
  return camera.rig_from_camera.rotation * Vector3d::UnitZ();
}
Vector3d down_of(const CameraCalibration& camera) {
  return camera.rig_from_camera.rotation * Vector3d::UnitY();
}

// Doubles that went through some rotations, in m.
constexpr double kRounding = 1e-12;

TEST(RigTemplates, StereoStandsApartToTheRight) {
  const auto cameras = cameras_of("template = \"stereo\"\nbaseline_mm = 250.0");
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].name, "cam_left");
  EXPECT_EQ(cameras[1].name, "cam_right");
  const geo::Rigid3d left_from_right =
      cameras[0].rig_from_camera.inverse() * cameras[1].rig_from_camera;
  EXPECT_LT((left_from_right.translation - Vector3d(0.25, 0.0, 0.0)).norm(), kRounding);
  EXPECT_LT(left_from_right.rotation.angularDistance(Eigen::Quaterniond::Identity()), 1e-9);
  const auto turned = cameras_of("template = \"stereo\"\nvergence_deg = 20.0");
  EXPECT_LT(axis_of(turned[0]).y(), 0.0);  // the left one to the right
  EXPECT_NEAR(axis_of(turned[0]).dot(axis_of(turned[1])), std::cos(geo::radians_from_degrees(20.0)),
              kRounding);
}

TEST(RigTemplates, ACylinderMakesThePapersFirstThree) {
  const auto cameras =
      cameras_of("template = \"cylinder\"\nnum_cameras = 3\nradius_mm = 300.0\nstep_deg = -30.0");
  ASSERT_EQ(cameras.size(), 3U);
  for (int i = 0; i < 3; ++i) {
    const double right = geo::radians_from_degrees(30.0 * i);
    const Vector3d outwards(std::cos(right), -std::sin(right), 0.0);
    EXPECT_LT((axis_of(cameras[i]) - outwards).norm(), kRounding);
    EXPECT_LT((cameras[i].rig_from_camera.translation - 0.3 * outwards).norm(), kRounding);
    EXPECT_LT((down_of(cameras[i]) + Vector3d::UnitZ()).norm(), kRounding);
  }
  const auto whole = cameras_of("template = \"cylinder\"\nnum_cameras = 8");
  for (int i = 0; i < 8; ++i)
    EXPECT_NEAR(axis_of(whole[i]).dot(axis_of(whole[(i + 1) % 8])),
                std::cos(geo::radians_from_degrees(45.0)), kRounding);
}

TEST(RigTemplates, ACompoundEyeFollowsItsPublishedTable) {
  RigOptions rig = core::read_toml<RigOptions>(std::filesystem::path(TERRACAST_SOURCE_DIR) /
                                               "configs/rigs/aces9.toml");
  const auto cameras = build_cameras({rig});
  ASSERT_EQ(cameras.size(), 9U);
  const double roll_deg[] = {0.0, 0.0, 41.93, 88.87, 132.52, 183.82, 223.16, 268.42, 314.32};
  const double pitch_deg[] = {0.0, 56.2, 55.0, 53.5, 53.0, 53.0, 52.0, 54.5, 55.0};
  for (std::size_t i = 0; i < 9; ++i) {
    // Rz(roll) Rx(pitch) z = (sin r sin p, -cos r sin p, cos p) in x right, y down, z forward.
    const double r = geo::radians_from_degrees(roll_deg[i]),
                 p = geo::radians_from_degrees(pitch_deg[i]);
    const Vector3d axis_rdf(std::sin(r) * std::sin(p), -std::cos(r) * std::sin(p), std::cos(p));
    const Vector3d axis_rig(axis_rdf.z(), -axis_rdf.x(), -axis_rdf.y());
    EXPECT_LT((axis_of(cameras[i]) - axis_rig).norm(), kRounding);
    EXPECT_LT((cameras[i].rig_from_camera.translation - 0.17 * axis_rig).norm(), kRounding);
    EXPECT_NEAR(cameras[i].intrinsics.parameters[0], 3.240 * 640.0 / 5.568, 1e-9);
    // Off the axis, the image's upper edge points away from it.
    if (i > 0) {
      EXPECT_GT(down_of(cameras[i]).dot(Vector3d::UnitX()), 0.7);
    }
  }
  // Roll goes clockwise as the camera on the axis sees it: cam3 is on its right.
  EXPECT_LT(axis_of(cameras[3]).y(), -0.7);
  EXPECT_GT(axis_of(cameras[1]).z(), 0.8);
}

TEST(RigTemplates, RingsOfACompoundEyeAreEven) {
  const auto cameras = cameras_of(
      "template = \"compound_eye\"\nring_cameras = [1, 6, 8]\nring_pitch_deg = [0.0, 30.0, 60.0]\n"
      "ring_roll_deg = [0.0, 10.0, 0.0]");
  ASSERT_EQ(cameras.size(), 15U);
  const auto angle = [&](int i, int k) {
    return geo::degrees_from_radians(std::acos(axis_of(cameras[i]).dot(axis_of(cameras[k]))));
  };
  for (int i = 1; i < 7; ++i) EXPECT_NEAR(angle(0, i), 30.0, 1e-9);
  for (int i = 7; i < 15; ++i) EXPECT_NEAR(angle(0, i), 60.0, 1e-9);
  for (int i = 2; i < 7; ++i) EXPECT_NEAR(angle(i - 1, i), angle(1, 2), 1e-9);
}

TEST(RigTemplates, AnArrayIsCentredAndReadsLikeText) {
  const auto cameras = cameras_of(
      "template = \"array\"\nrows = 2\ncolumns = 3\nrow_spacing_mm = 40.0\ncolumn_spacing_mm = "
      "100.0");
  ASSERT_EQ(cameras.size(), 6U);
  EXPECT_EQ(cameras[0].name, "cam0_0");
  EXPECT_EQ(cameras[5].name, "cam1_2");
  EXPECT_LT((cameras[0].rig_from_camera.translation - Vector3d(0.0, 0.1, 0.02)).norm(), kRounding);
  EXPECT_LT((cameras[5].rig_from_camera.translation - Vector3d(0.0, -0.1, -0.02)).norm(),
            kRounding);
}

TEST(RigTemplates, ACubeTurnsAsTartanAirsSix) {
  const auto cube = cameras_of("template = \"cube\"");
  const auto tartan = build_cameras({core::read_toml<RigOptions>(
      std::filesystem::path(TERRACAST_SOURCE_DIR) / "configs/rigs/tartan12.toml")});
  ASSERT_EQ(cube.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ("l" + cube[i].name, tartan[i].name);
    EXPECT_LT(cube[i].rig_from_camera.rotation.angularDistance(tartan[i].rig_from_camera.rotation),
              1e-7);
  }
}

TEST(RigTemplates, SurroundStandsOnTheOutline) {
  const auto cameras = cameras_of(
      "template = \"surround\"\nlength_mm = 4000.0\nwidth_mm = 2000.0\nyaw_deg = [0.0, 90.0, 45.0, "
      "180.0]\n"
      "height_mm = 1500.0\npitch_deg = 5.0");
  ASSERT_EQ(cameras.size(), 4U);
  const Vector3d places[] = {{2.0, 0.0, 1.5}, {0.0, 1.0, 1.5}, {1.0, 1.0, 1.5}, {-2.0, 0.0, 1.5}};
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT((cameras[i].rig_from_camera.translation - places[i]).norm(), kRounding);
    EXPECT_NEAR(axis_of(cameras[i]).z(), -std::sin(geo::radians_from_degrees(5.0)), kRounding);
  }
}

TEST(RigTemplates, AreReadBackFromWhatIsWritten) {
  const RigOptions rig = rig_from("template = \"cylinder\"\nnum_cameras = 4\nradius_mm = 12.5");
  RigOptions back;
  core::TomlDocument::parse(core::toml_text(rig), "rig.toml").read(back);
  EXPECT_EQ(core::toml_text(back), core::toml_text(rig));
  const RigOptions copy = rig;
  EXPECT_EQ(build_cameras({copy}), build_cameras({back}));
}

TEST(RigTemplates, ContradictionsAreRefused) {
  const auto expect = [](const std::string& keys, const std::vector<std::string>& words,
                         const std::string& cameras = kCamera) {
    SCOPED_TRACE(keys);
    expect_error(core::ErrorKind::Config, words, [&] { build_cameras({rig_from(keys, cameras)}); });
  };
  expect("template = \"sphere\"", {"sphere", "compound_eye"});
  expect("template = \"stereo\"\nradius_mm = 3.0", {"radius_mm"});
  expect("baseline_mm = 3.0", {"baseline_mm"});
  expect("template = \"stereo\"", {"2 cameras beside template", "takes one"}, kCamera + kCamera);
  expect("template = \"stereo\"", {"cam", "leave it out"},
         kCamera + "offset_mm = [1.0, 0.0, 0.0]\n");
  expect("template = \"stereo\"\naxes = \"rdf\"", {"axes"});
  expect("template = \"compound_eye\"", {"no cameras", "ring_cameras"});
  expect("template = \"compound_eye\"\nring_cameras = [1, 8]\nring_pitch_deg = [0.0]",
         {"ring_cameras has 2"});
  expect("template = \"compound_eye\"\nroll_deg = [1.0]\npitch_deg = []", {"roll_deg has 1"});
  expect("template = \"compound_eye\"\nring_cameras = [1]\nroll_deg = [1.0]\npitch_deg = [1.0]",
         {"both rings"});
  expect("template = \"surround\"\nyaw_deg = []", {"yaw_deg is empty"});
  expect("template = \"array\"\nrows = 5\ncolumns = 5", {"25 cameras"});
}

}  // namespace
}  // namespace terracast::rigs
