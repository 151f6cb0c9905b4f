#include "geo/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

TEST(CameraModels, AnUnknownModelIsRefusedAndTheNearestNamed) {
  try {
    make_camera({"pinhol", 10, 10, {1, 1, 1, 1}});
    FAIL();
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Config);
    EXPECT_NE(error.message().find("pinhole"), std::string::npos) << error.message();
  }
}

TEST(PinholeCamera, SpansItsStatedFieldOfView) {
  // 20 mm focal length before a 20 mm image plane: 2 atan(1/2) = 53.13 deg across.
  const auto camera = make_camera({"pinhole", 720, 640, {720.0, 720.0, 360.0, 320.0}});
  const auto across = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return degrees_from_radians(std::acos(
        camera->ray_from_pixel(a).normalized().dot(camera->ray_from_pixel(b).normalized())));
  };
  EXPECT_NEAR(across({0, 320}, {720, 320}), 53.13010235415598, 1e-9);
  EXPECT_NEAR(across({360, 0}, {360, 640}), 2 * degrees_from_radians(std::atan(320.0 / 720.0)),
              1e-9);
  EXPECT_EQ(camera->ray_from_pixel({360, 320}), Eigen::Vector3d::UnitZ());
}

TEST(PinholeCamera, SeesNothingBehindIt) {
  const auto camera = make_camera({"pinhole", 720, 640, {720.0, 720.0, 360.0, 320.0}});
  EXPECT_FALSE(camera->pixel_from_ray({0.0, 0.0, -1.0}));
  EXPECT_FALSE(camera->pixel_from_ray({1.0, 0.0, 0.0}));
  ASSERT_TRUE(camera->pixel_from_ray({10.0, 0.0, 1.0}));  // outside the image is still a pixel
  EXPECT_FALSE(camera->contains(*camera->pixel_from_ray({10.0, 0.0, 1.0})));
  EXPECT_FALSE(camera->contains({720.0, 3.0}));
  EXPECT_TRUE(camera->contains({0.0, 0.0}));
}

}  // namespace
}  // namespace terracast::geo
