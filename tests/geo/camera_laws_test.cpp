#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/random.h"
#include "geo/camera_model.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

constexpr std::uint64_t kSeed = 2;

/// A table of another camera's rays.
/// first   image point of the first node; they go on to as far from the other border
CameraIntrinsics table_of(const CameraIntrinsics& camera, double first, int columns, int rows) {
  const auto model = make_camera(camera);
  const double step_x = (camera.width_px - 2 * first) / (columns - 1);
  const double step_y = (camera.height_px - 2 * first) / (rows - 1);
  CameraIntrinsics table{"tabulated",
                         camera.width_px,
                         camera.height_px,
                         {step_x, step_y, first, first, 1.0 * columns, 1.0 * rows}};
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Eigen::Vector3d ray = model->ray_from_pixel({first + i * step_x, first + j * step_y});
      table.parameters.insert(table.parameters.end(), ray.begin(), ray.end());
    }
  }
  return table;
}

/// A camera of each model, or several, that the laws are tried on: narrow and wide ones, and images
/// that hold more than the model sees.
const std::vector<CameraIntrinsics>& examples() {
  constexpr double kSphere_px = 1024 / (2 * std::numbers::pi);
  static const std::vector<CameraIntrinsics> table{
      {"cylindrical", 1024, 300, {kSphere_px, kSphere_px, 512, 150}},
      {"cylindrical", 720, 640, {300.0, 310.0, 371.3, 318.9}},
      {"double_sphere", 720, 640, {300.0, 310.0, 371.3, 318.9, -0.2, 0.6}},
      {"double_sphere", 720, 640, {180.0, 180.0, 371.3, 318.9, 0.4, 0.7}},
      {"equirectangular", 1024, 512, {kSphere_px, kSphere_px, 512, 256}},
      {"equirectangular", 720, 640, {300.0, 310.0, 371.3, 318.9}},
      {"extended_unified", 720, 640, {300.0, 310.0, 371.3, 318.9, 0.4, 1.1}},
      {"extended_unified", 720, 640, {180.0, 180.0, 371.3, 318.9, 0.65, 0.9}},
      {"fov", 720, 640, {400.0, 410.0, 371.3, 318.9, 0.9}},
      {"full_opencv",
       720,
       640,
       {500.0, 510.0, 371.3, 318.9, 0.3, -0.1, 1e-3, -8e-4, 0.02, 0.6, 0.1, 0.01}},
      {"opencv", 720, 640, {500.0, 510.0, 371.3, 318.9, -0.2, 0.05, 2e-3, -1e-3}},
      {"opencv_fisheye", 720, 640, {220.0, 221.0, 371.3, 318.9, 0.01, -0.005, 0.001, -0.0002}},
      {"opencv_fisheye", 720, 640, {150.0, 150.0, 360.0, 320.0, -0.05, 0.0, 0.0, 0.0}},
      {"orthographic", 720, 640, {4.0, 5.0, 371.3, 318.9}},
      {"pinhole", 720, 640, {720.5, 640.25, 371.3, 318.9}},
      {"pushbroom", 720, 640, {720.5, 3.5, 371.3, 318.9}},
      {"radial", 720, 640, {500.0, 510.0, 371.3, 318.9, -0.25, 0.06}},
      {"simple_radial", 720, 640, {500.0, 500.0, 371.3, 318.9, -0.15}},
      {"simple_radial", 720, 640, {300.0, 300.0, 371.3, 318.9, -0.15}},
      table_of({"opencv", 720, 640, {500.0, 510.0, 371.3, 318.9, -0.2, 0.05, 2e-3, -1e-3}}, 0.0, 19,
               17),
      table_of({"double_sphere", 720, 640, {300.0, 310.0, 371.3, 318.9, -0.2, 0.6}}, 12.0, 31, 29),
      {"thin_prism_fisheye",
       720,
       640,
       {250.0, 251.0, 371.3, 318.9, 0.02, -0.01, 1e-3, -8e-4, 0.002, -0.0004, 1e-3, -2e-3}},
      {"unified", 720, 640, {500.0, 510.0, 371.3, 318.9, 0.9, -0.2, 0.05, 1e-3, -8e-4}},
      {"unified", 720, 640, {350.0, 350.0, 371.3, 318.9, 1.3, 0.0, 0.0, 0.0, 0.0}},
  };
  return table;
}

Eigen::Vector2d random_pixel(const CameraModel& camera, std::uint64_t index) {
  return {core::random_between(0, camera.width_px(), kSeed, 1, index),
          core::random_between(0, camera.height_px(), kSeed, 2, index)};
}

Eigen::Vector3d point_on_ray(const CameraModel& camera, const Eigen::Vector2d& pixel, double t) {
  return camera.origin_from_pixel(pixel) + t * camera.ray_from_pixel(pixel);
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

class CameraLaws : public testing::TestWithParam<CameraIntrinsics> {
 protected:
  std::unique_ptr<CameraModel> camera_ = make_camera(GetParam());
};

TEST_P(CameraLaws, PixelToRayToPixelReturns) {
  int num_rays = 0;
  double farthest = 0.0;
  for (std::uint64_t i = 0; i < 10000; ++i) {
    const Eigen::Vector2d pixel = random_pixel(*camera_, i);
    const Eigen::Vector3d ray = camera_->ray_from_pixel(pixel);
    if (!ray.allFinite()) continue;
    ++num_rays;
    ASSERT_TRUE(ray.z() == 1.0 || std::abs(ray.norm() - 1.0) < 4e-15);
    const double t = core::random_between(1e-3, 1e6, kSeed, 3, i);
    const auto back = camera_->pixel_from_ray(point_on_ray(*camera_, pixel, t));
    ASSERT_TRUE(back) << pixel.transpose();
    farthest = std::max(farthest, (*back - pixel).norm());
  }
  // Rounding of 1000 px, some hundred times over; where rays end sideways it grows.
  EXPECT_LT(farthest, GetParam().model == "pinhole" ? 1e-11 : 1e-9);
  EXPECT_GT(num_rays, 4000);
  RecordProperty("num_rays", num_rays);
}

// A camera that folds its image has two rays for a pixel.
TEST_P(CameraLaws, WhatIsSeenIsSeenAtOnePlace) {
  int num_seen = 0;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    Eigen::Vector3d point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = core::random_between(-1, 1, kSeed, 30 + axis, i);
    if (!camera_->is_central()) point *= 100.0;
    const auto pixel = camera_->pixel_from_ray(point);
    if (!pixel) continue;
    ++num_seen;
    const Eigen::Vector3d ray = camera_->ray_from_pixel(*pixel);
    ASSERT_TRUE(ray.allFinite()) << point.transpose();
    // At the rim the image's radius has a maximum: the root of a rounding.
    ASSERT_LT(angle_between(ray, point - camera_->origin_from_pixel(*pixel)), 1e-6)
        << point.transpose();
  }
  EXPECT_GT(num_seen, 2000);
}

TEST_P(CameraLaws, NothingIsNoRayAndNoPixel) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(camera_->pixel_from_ray({nan, 0.1, 1.0}));
  EXPECT_FALSE(camera_->pixel_from_ray({0.1, 0.1, nan}));
  if (camera_->is_central()) {
    EXPECT_FALSE(camera_->pixel_from_ray(Eigen::Vector3d::Zero()));
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
    for (int k = 0; k < PixelBlock::kPixels; ++k) {
      const Eigen::Vector3d ray = camera_->ray_from_pixel({pixels.x[k], pixels.y[k]});
      const Eigen::Vector3d found(rays.x[k], rays.y[k], rays.z[k]);
      ASSERT_EQ(found.allFinite(), ray.allFinite());
      if (ray.allFinite()) {
        ASSERT_EQ(found, ray);
      }
    }
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
        ray = point_on_ray(*camera_, pixel, core::random_between(0.5, 2.0, kSeed, 23, index));
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
  EXPECT_GT(num_in, 1000);
  EXPECT_LT(num_in, 40000);
}

TEST_P(CameraLaws, JacobianIsTheCentralDifference) {
  const bool has_poles = GetParam().model == "equirectangular" || GetParam().model == "cylindrical";
  int num_compared = 0;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const double t = core::random_between(0.5, 2.0, kSeed, 4, i);
    const Eigen::Vector3d point = point_on_ray(*camera_, random_pixel(*camera_, i), t);
    // Beside a pole the differences tell of its other side.
    const bool is_at_pole =
        has_poles && std::hypot(point.x(), point.z()) < 0.05 * std::abs(point.y());
    if (!point.allFinite() || is_at_pole) continue;
    const Eigen::Matrix<double, 2, 3> jacobian = camera_->pixel_jacobian(point);
    constexpr double kStep = 2e-6;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      const auto after = camera_->pixel_from_ray(point + step);
      const auto before = camera_->pixel_from_ray(point - step);
      if (!after || !before) continue;  // at the rim
      const Eigen::Vector2d difference = (*after - *before) / (2.0 * kStep);
      // Truncation is step^2 of the third derivative, rounding 1e-13 px over the step.
      ASSERT_LT((jacobian.col(axis) - difference).norm(), 1e-6 * jacobian.norm());
      ++num_compared;
    }
    if (camera_->is_central()) {
      ASSERT_LT((jacobian * point).norm(), 1e-9);  // a ray's length does not move its pixel
    }
  }
  EXPECT_GT(num_compared, 1000);
}

TEST_P(CameraLaws, NoPixelSpansFewerAngleThanStated) {
  if (!camera_->is_central()) GTEST_SKIP() << "what a radian spans is no pixel's alone";
  const bool has_poles = GetParam().model == "equirectangular";
  double finest = 0.0;
  Eigen::Vector2d finest_pixel(0.0, 0.0);
  const auto look = [&](const Eigen::Vector2d& pixel, double direction) {
    const Eigen::Vector2d step(1e-3 * std::cos(direction), 1e-3 * std::sin(direction));
    const Eigen::Vector3d a = camera_->ray_from_pixel(pixel - step);
    const Eigen::Vector3d b = camera_->ray_from_pixel(pixel + step);
    if (!a.allFinite() || !b.allFinite()) return;
    const double value = 2e-3 / angle_between(a, b);
    if (value > finest) {
      finest = value;
      finest_pixel = pixel;
    }
  };
  const auto direction_of = [&](std::uint64_t i) {
    return has_poles ? 0.5 * std::numbers::pi
                     : core::random_between(0, 2 * std::numbers::pi, kSeed, 5, i);
  };
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const bool is_at_corner = i < 1000;
    look(is_at_corner ? Eigen::Vector2d(i % 2 == 0 ? 0.0 : camera_->width_px(),
                                        i % 4 < 2 ? 0.0 : camera_->height_px())
                      : random_pixel(*camera_, i),
         direction_of(i));
  }
  // It may be finest on the rim of what is seen, where few pixels lie: nearer and nearer to the best.
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const double reach_px = 100.0 * std::pow(0.9994, static_cast<double>(i));
    const Eigen::Vector2d pixel =
        finest_pixel + Eigen::Vector2d(core::random_between(-reach_px, reach_px, kSeed, 40, i),
                                       core::random_between(-reach_px, reach_px, kSeed, 41, i));
    if (camera_->contains(pixel)) look(pixel, direction_of(i));
  }
  EXPECT_LE(finest, camera_->finest_pixels_per_radian() * (1.0 + 1e-6));
  // On a rim it rises like a root: the last thousandth of a pixel, which has no neighbour outside, holds some
  // per cent of it.
  EXPECT_GE(finest, camera_->finest_pixels_per_radian() * 0.9);
}

TEST_P(CameraLaws, IsMadeAgainFromItsIntrinsics) {
  const auto again = make_camera(camera_->intrinsics());
  EXPECT_EQ(again->intrinsics(), camera_->intrinsics());
  const Eigen::Vector2d pixel(250.25, 200.5);
  ASSERT_TRUE(camera_->ray_from_pixel(pixel).allFinite());
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
  CameraIntrinsics intrinsics = GetParam();
  intrinsics.width_px = 0;
  refuses(intrinsics);
  intrinsics = GetParam();
  intrinsics.height_px = -1;
  refuses(intrinsics);
  intrinsics = GetParam();
  intrinsics.parameters.push_back(0.0);
  refuses(intrinsics);
  intrinsics.parameters.clear();
  refuses(intrinsics);
  intrinsics = GetParam();
  intrinsics.parameters[0] = std::numeric_limits<double>::quiet_NaN();
  refuses(intrinsics);
  for (const std::size_t focal : {0, 1}) {
    intrinsics = GetParam();
    intrinsics.parameters[focal] = 0.0;
    refuses(intrinsics);
  }
}

INSTANTIATE_TEST_SUITE_P(AllModels, CameraLaws, testing::ValuesIn(examples()),
                         [](const auto& example) {
                           return fmt::format("{}_{}", example.param.model, example.index);
                         });

TEST(CameraModels, EachIsTriedByTheLaws) {
  for (const CameraModelInfo& info : camera_models())
    EXPECT_TRUE(std::any_of(examples().begin(), examples().end(), [&](const CameraIntrinsics& e) {
      return e.model == info.name;
    })) << info.name;
}

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
