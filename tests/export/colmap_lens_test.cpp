#include <gtest/gtest.h>

#include "core/error.h"
#include "export/colmap_model.h"

namespace terracast::exporters {
namespace {

using Parameters = std::vector<double>;

std::string message_of(const geo::CameraIntrinsics& intrinsics) {
  try {
    check_colmap_camera(intrinsics);
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Config);
    return error.what();
  }
  return "";
}

// Numbers and orders of COLMAP's camera_models.h.
TEST(ColmapLens, HasColmapsNameNumberAndOrder) {
  const auto expect = [](const geo::CameraIntrinsics& ours, const std::string& model, int number,
                         const Parameters& parameters) {
    const ColmapLens lens = colmap_lens(ours);
    EXPECT_EQ(lens.model, model);
    EXPECT_EQ(lens.number, number);
    EXPECT_EQ(lens.parameters, parameters);
    EXPECT_EQ(message_of(ours), "");
  };
  expect({"pinhole", 64, 48, {50, 51, 32, 24}}, "PINHOLE", 1, {50, 51, 32, 24});
  expect({"simple_radial", 64, 48, {50, 50, 32, 24, -0.1}}, "SIMPLE_RADIAL", 2, {50, 32, 24, -0.1});
  expect({"radial", 64, 48, {50, 50, 32, 24, -0.1, 0.01}}, "RADIAL", 3, {50, 32, 24, -0.1, 0.01});
  expect({"opencv", 64, 48, {50, 51, 32, 24, -0.1, 0.01, 0.001, 0.002}}, "OPENCV", 4,
         {50, 51, 32, 24, -0.1, 0.01, 0.001, 0.002});
  expect({"opencv_fisheye", 64, 48, {50, 51, 32, 24, -0.1, 0.01, 0, 0}}, "OPENCV_FISHEYE", 5,
         {50, 51, 32, 24, -0.1, 0.01, 0, 0});
  expect({"full_opencv", 64, 48, {50, 51, 32, 24, 1, 2, 0, 0, 3, 4, 5, 6}}, "FULL_OPENCV", 6,
         {50, 51, 32, 24, 1, 2, 0, 0, 3, 4, 5, 6});
  expect({"fov", 64, 48, {50, 51, 32, 24, 0.9}}, "FOV", 7, {50, 51, 32, 24, 0.9});
  expect({"thin_prism_fisheye", 64, 48, {50, 51, 32, 24, 0, 0, 0, 0, 0, 0, 0.001, 0}},
         "THIN_PRISM_FISHEYE", 10, {50, 51, 32, 24, 0, 0, 0, 0, 0, 0, 0.001, 0});
}

TEST(ColmapLens, OneOfTwoFocalLengthsBecomesAnOpenCvCamera) {
  const ColmapLens lens = colmap_lens({"radial", 64, 48, {50, 51, 32, 24, -0.1, 0.01}});
  EXPECT_STREQ(lens.model, "OPENCV");
  EXPECT_EQ(lens.number, 4);
  EXPECT_EQ(lens.parameters, (Parameters{50, 51, 32, 24, -0.1, 0.01, 0, 0}));
}

TEST(ColmapLens, WhatColmapCannotHoldIsRefused) {
  EXPECT_NE(
      message_of({"double_sphere", 64, 48, {50, 50, 32, 24, 0.1, 0.5}}).find("opencv_fisheye"),
      std::string::npos);
  // 32 px at 18 px a radian: 102 degrees.
  EXPECT_NE(message_of({"opencv_fisheye", 64, 48, {18, 18, 32, 24, 0, 0, 0, 0}}).find("behind"),
            std::string::npos);
  // The circle ends before the corners: what has no ray does not look back.
  EXPECT_EQ(message_of({"opencv_fisheye", 64, 48, {30, 30, 32, 24, -0.15, 0, 0, 0}}), "");
}

}  // namespace
}  // namespace terracast::exporters
