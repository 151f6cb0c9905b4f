#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/random.h"
#include "geo/camera_model.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

constexpr std::uint64_t kSeed = 2;

/// A camera of each model that the laws are tried on.
CameraIntrinsics example_of(std::string_view model) {
  if (model == "pinhole") return {"pinhole", 720, 640, {720.5, 640.25, 371.3, 318.9}};
  ADD_FAILURE() << "camera model " << model << " has no example here";
  return {};
}

Eigen::Vector2d random_pixel(const CameraModel& camera, std::uint64_t index) {
  return {core::random_between(0, camera.width_px(), kSeed, 1, index),
          core::random_between(0, camera.height_px(), kSeed, 2, index)};
}

class CameraLaws : public testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<CameraModel> camera_ = make_camera(example_of(GetParam()));
};

TEST_P(CameraLaws, PixelToRayToPixelReturns) {
  for (std::uint64_t i = 0; i < 10000; ++i) {
    const Eigen::Vector2d pixel = random_pixel(*camera_, i);
    const Eigen::Vector3d ray = camera_->ray_from_pixel(pixel);
    const double scale = core::random_between(1e-3, 1e6, kSeed, 3, i);
    const auto back = camera_->pixel_from_ray(scale * ray);
    ASSERT_TRUE(back);
    ASSERT_LT((*back - pixel).norm(), 1e-11);  // 50 roundings of 720 px
    ASSERT_TRUE(ray.z() == 1.0 || std::abs(ray.norm() - 1.0) < 1e-15);
  }
}

TEST_P(CameraLaws, SeveralPixelsHaveTheRaysThatEachOneHas) {
  for (std::uint64_t i = 0; i < 1000; ++i) {
    PixelBlock pixels;
    for (int k = 0; k < PixelBlock::kPixels; ++k) {
      const Eigen::Vector2d pixel =
          random_pixel(*camera_, i * PixelBlock::kPixels + static_cast<std::uint64_t>(k));
      pixels.x[k] = pixel.x();
      pixels.y[k] = pixel.y();
    }
    VectorBlock rays;
    camera_->find_rays(pixels, rays);
    for (int k = 0; k < PixelBlock::kPixels; ++k)
      ASSERT_EQ(Eigen::Vector3d(rays.x[k], rays.y[k], rays.z[k]),
                camera_->ray_from_pixel({pixels.x[k], pixels.y[k]}));
  }
}

// Rays all around, and rays a few roundings on either side of the image's borders.
TEST_P(CameraLaws, SeveralRaysAreInTheImageAsEachOneIs) {
  int num_in = 0;
  for (std::uint64_t i = 0; i < 5000; ++i) {
    VectorBlock block;
    std::uint32_t expected = 0;
    for (int k = 0; k < VectorBlock::kVectors; ++k) {
      const std::uint64_t index = i * VectorBlock::kVectors + static_cast<std::uint64_t>(k);
      Eigen::Vector3d ray;
      if (k % 2 == 0) {
        for (int axis = 0; axis < 3; ++axis)
          ray[axis] = core::random_between(-1, 1, kSeed, 20 + axis, index);
      } else {
        Eigen::Vector2d pixel = random_pixel(*camera_, index);
        pixel[k / 2 % 2] =
            k < 4 ? 0.0 : (k / 2 % 2 == 0 ? camera_->width_px() : camera_->height_px());
        ray = camera_->ray_from_pixel(pixel) * core::random_between(0.5, 2.0, kSeed, 23, index);
      }
      block.x[k] = ray.x();
      block.y[k] = ray.y();
      block.z[k] = ray.z();
      const auto pixel = camera_->pixel_from_ray(ray);
      if (pixel && camera_->contains(*pixel)) expected |= std::uint32_t{1} << k;
    }
    ASSERT_EQ(camera_->find_in_image(block), expected) << i;
    num_in += __builtin_popcount(expected);
  }
  EXPECT_GT(num_in, 5000);
  EXPECT_LT(num_in, 35000);
}

TEST_P(CameraLaws, JacobianIsTheCentralDifference) {
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const double scale = core::random_between(0.5, 2.0, kSeed, 4, i);
    const Eigen::Vector3d ray = scale * camera_->ray_from_pixel(random_pixel(*camera_, i));
    const Eigen::Matrix<double, 2, 3> jacobian = camera_->pixel_jacobian(ray);
    constexpr double kStep = 1e-5;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector2d difference =
          (*camera_->pixel_from_ray(ray + step) - *camera_->pixel_from_ray(ray - step)) /
          (2.0 * kStep);
      // Truncation is step^2 of the third derivative, rounding 1e-13 px over the step.
      ASSERT_LT((jacobian.col(axis) - difference).norm(), 1e-6 * jacobian.norm());
    }
    ASSERT_LT((jacobian * ray).norm(), 1e-9);  // a ray's length does not move its pixel
  }
}

TEST_P(CameraLaws, NoPixelSpansFewerAngleThanStated) {
  double finest = 0.0;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    Eigen::Vector2d pixel = random_pixel(*camera_, i);
    const bool is_at_corner = i < 1000;
    if (is_at_corner) {
      pixel = Eigen::Vector2d(i % 2 == 0 ? 0.0 : camera_->width_px(),
                              i % 4 < 2 ? 0.0 : camera_->height_px());
    }
    const double direction = core::random_between(0, 2 * std::numbers::pi, kSeed, 5, i);
    const Eigen::Vector2d step(1e-3 * std::cos(direction), 1e-3 * std::sin(direction));
    const Eigen::Vector3d a = camera_->ray_from_pixel(pixel - step).normalized();
    const Eigen::Vector3d b = camera_->ray_from_pixel(pixel + step).normalized();
    const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
    finest = std::max(finest, 2e-3 / angle);
  }
  EXPECT_LE(finest, camera_->finest_pixels_per_radian() * (1.0 + 1e-6));
  EXPECT_GE(finest, camera_->finest_pixels_per_radian() * 0.99);
}

TEST_P(CameraLaws, IsMadeAgainFromItsIntrinsics) {
  const auto again = make_camera(camera_->intrinsics());
  EXPECT_EQ(again->intrinsics(), camera_->intrinsics());
  const Eigen::Vector2d pixel(10.25, 600.5);
  EXPECT_EQ(again->ray_from_pixel(pixel), camera_->ray_from_pixel(pixel));
}

TEST_P(CameraLaws, RefusesWrongParameters) {
  const auto refuses = [](const CameraIntrinsics& intrinsics) {
    try {
      make_camera(intrinsics);
      ADD_FAILURE() << "no error";
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Config) << error.what();
    }
  };
  CameraIntrinsics intrinsics = example_of(GetParam());
  intrinsics.width_px = 0;
  refuses(intrinsics);
  intrinsics = example_of(GetParam());
  intrinsics.height_px = -1;
  refuses(intrinsics);
  intrinsics = example_of(GetParam());
  intrinsics.parameters.push_back(0.0);
  refuses(intrinsics);
  intrinsics.parameters.clear();
  refuses(intrinsics);
  intrinsics = example_of(GetParam());
  intrinsics.parameters[0] = std::numeric_limits<double>::quiet_NaN();
  refuses(intrinsics);
}

std::vector<std::string> model_names() {
  std::vector<std::string> names;
  for (const CameraModelInfo& info : camera_models()) names.emplace_back(info.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(AllModels, CameraLaws, testing::ValuesIn(model_names()),
                         [](const auto& model) { return model.param; });

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
