#include "capture/labels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/tiny_capture.h"

namespace terracast::capture {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix3l = Eigen::Matrix<long double, 3, 3>;
using Vector3l = Eigen::Matrix<long double, 3, 1>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The pinhole's formulas again, with 64-bit mantissas and rotation matrices.
struct ExactView {
  long double fx, fy, cx, cy;
  Matrix3l world_from_camera;
  Vector3l center;

  ExactView(const CameraCalibration& camera, const geo::Rigid3d& pose)
      : fx(camera.intrinsics.parameters[0]),
        fy(camera.intrinsics.parameters[1]),
        cx(camera.intrinsics.parameters[2]),
        cy(camera.intrinsics.parameters[3]),
        world_from_camera(pose.rotation.cast<long double>().normalized().toRotationMatrix()),
        center(pose.translation.cast<long double>()) {}

  Vector3l direction(const Vector2d& pixel) const {
    const Vector3l ray((static_cast<long double>(pixel.x()) - cx) / fx,
                       (static_cast<long double>(pixel.y()) - cy) / fy, 1.0L);
    return ray / std::sqrt(ray.squaredNorm());
  }
  Vector3l point(const Vector2d& pixel, long double range_m) const {
    return center + world_from_camera * (direction(pixel) * range_m);
  }
  Vector2d pixel_of_direction(const Vector3l& d) const {
    return {static_cast<double>(fx * d.x() / d.z() + cx),
            static_cast<double>(fy * d.y() / d.z() + cy)};
  }
  Vector2d pixel_of(const Vector3l& point_world) const {
    return pixel_of_direction(world_from_camera.transpose() * (point_world - center));
  }
};

struct Labels : testing::Test {
  test::TinyCaptureOptions options{.has_tartan2 = false};
  SequenceInfo info = test::tiny_sequence(options);
  const CameraCalibration& camera = info.cameras[1];  // turned by 30 deg: no axis is special
  std::unique_ptr<geo::CameraModel> model = geo::make_camera(camera.intrinsics);
  geo::Rigid3d pose0 = test::tiny_world_from_camera(options, 0, camera);
  geo::Rigid3d pose1 = test::tiny_world_from_camera(options, 1, camera);
  CameraView view0{*model, pose0};
  CameraView view1{*model, pose1};
  ExactView exact0{camera, pose0};
  ExactView exact1{camera, pose1};
};

TEST_F(Labels, DepthIsRangeTimesTheCosineToTheAxis) {
  for (const Vector2d& pixel : {Vector2d(0.5, 0.5), Vector2d(44.7, 12.25), Vector2d(89.5, 79.5)}) {
    const double cosine = static_cast<double>(exact0.direction(pixel).z());
    EXPECT_NEAR(depth_from_range(*model, pixel, 1234.5), 1234.5 * cosine, 1e-12 * 1234.5);
    EXPECT_EQ(depth_from_range(*model, pixel, kInfinity), kInfinity);
  }
  EXPECT_DOUBLE_EQ(depth_from_range(*model, {45.0, 40.0}, 7.0), 7.0);  // on the axis
}

// The world's numbers are 2e4 m: a unit in the last place is 3.6e-12 m, and a rotation rounds at
// 2e-16 of a range.
TEST_F(Labels, PointsAgreeWithLongDouble) {
  for (const double range_m : {1.0, 150.0, 40000.0}) {
    for (int i = 0; i < 40; ++i) {
      const Vector2d pixel = pixel_center(2 * i + 3, 79 - 2 * i);
      const Vector3l truth = exact0.point(pixel, static_cast<long double>(range_m));
      const Vector3d point = point_world(view0, pixel, range_m);
      EXPECT_LE(static_cast<double>((point.cast<long double>() - truth).norm()),
                1.5e-11 + 1e-15 * range_m);
    }
  }
}

TEST_F(Labels, ProjectionAgreesWithLongDoubleAndInvertsThePoint) {
  for (int i = 0; i < 40; ++i) {
    const Vector2d pixel(2.2 * i, 1.9 * i);
    const Vector3d point = point_world(view0, pixel, 120.0 + 31.0 * i);
    const auto back = project(view0, point);
    ASSERT_TRUE(back);
    EXPECT_LE((*back - pixel).norm(), 1e-10);  // 1e-11 m at 120 m, 90 px a radian
    const auto other = project(view1, point);
    ASSERT_TRUE(other);
    EXPECT_LE((*other - exact1.pixel_of(point.cast<long double>())).norm(), 1e-10);
  }
}

TEST_F(Labels, NothingBehindTheCameraProjects) {
  const Vector3d behind = pose0 * Vector3d(0.1, 0.2, -5.0);
  EXPECT_FALSE(project(view0, behind));
  // A camera that has flown past the point: no flow.
  const CameraView past{*model, {pose0.rotation, pose0 * Vector3d(0.0, 0.0, 50.0)}};
  EXPECT_FALSE(flow(view0, past, {45.0, 40.0}, 20.0));
}

TEST_F(Labels, FlowIsTheDifferenceOfProjections) {
  for (const double range_m : {30.0, 400.0, 30000.0}) {
    for (int i = 0; i < 40; ++i) {
      const Vector2d pixel = pixel_center(2 * i + 3, 2 * i);
      const Vector2d truth =
          exact1.pixel_of(exact0.point(pixel, static_cast<long double>(range_m))) - pixel;
      const auto motion = flow(view0, view1, pixel, range_m);
      ASSERT_TRUE(motion);
      EXPECT_LE((*motion - truth).norm(), 1e-11) << range_m;  // the centres' difference is exact
    }
  }
}

TEST_F(Labels, SkyFlowIsRotationOnly) {
  const Vector2d pixel(33.5, 20.5);
  const Vector2d truth =
      exact1.pixel_of_direction(exact1.world_from_camera.transpose() * exact0.world_from_camera *
                                exact0.direction(pixel)) -
      pixel;
  const auto motion = flow(view0, view1, pixel, kInfinity);
  ASSERT_TRUE(motion);
  EXPECT_LE((*motion - truth).norm(), 1e-11);
  const CameraView moved_far{*model, {pose0.rotation, pose0.translation + Vector3d(900, 0, 40)}};
  EXPECT_LE(flow(view0, moved_far, pixel, kInfinity)->norm(), 1e-11);
}

TEST_F(Labels, ImagesHoldTheRoundedDoubles) {
  const CameraFrame frame = test::tiny_frame(options, info, 0, 1);
  const core::ImageF depth_m = depth_image(*model, frame.range_m);
  const core::ImageF motion_px = flow_image(view0, view1, frame.range_m);
  int num_sky = 0;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 90; ++x) {
      const double range_m = static_cast<double>(frame.range_m(x, y));
      num_sky += std::isinf(range_m) ? 1 : 0;
      const Vector2d pixel = pixel_center(x, y);
      EXPECT_EQ(depth_m(x, y), static_cast<float>(depth_from_range(*model, pixel, range_m)));
      const auto motion = flow(view0, view1, pixel, range_m);
      ASSERT_TRUE(motion);
      EXPECT_EQ(motion_px(x, y, 0), static_cast<float>(motion->x()));
      EXPECT_EQ(motion_px(x, y, 1), static_cast<float>(motion->y()));
    }
  }
  EXPECT_GT(num_sky, 0);  // both cases were seen
  EXPECT_LT(num_sky, 90 * 80);
}

// Depth of a plane has closed form: 1 / z is linear in the pixel. The scene casts in double, the
// image is float32.
TEST_F(Labels, DepthOfAPlaneIsItsClosedForm) {
  const test::TinyScene scene;
  const CameraFrame frame = test::tiny_frame(options, info, 0, 1);
  const core::ImageF depth_m = depth_image(*model, frame.range_m);
  const Vector3d normal_camera = pose0.rotation.conjugate() * scene.ground_normal;
  const double distance_m = scene.ground_normal.dot(scene.ground_point - pose0.translation);
  for (int y = 0; y < 80; y += 3) {
    for (int x = 0; x < 90; x += 3) {
      if (std::isinf(depth_m(x, y)) || frame.instance_id(x, y) != 0) continue;
      const double truth = distance_m / normal_camera.dot(test::tiny_ray(camera, x + 0.5, y + 0.5));
      EXPECT_NEAR(static_cast<double>(depth_m(x, y)), truth, 1.2e-7 * truth);  // two roundings
    }
  }
}

TEST_F(Labels, FlowImageMarksWhatLiesBehind) {
  const CameraView past{*model, {pose0.rotation, pose0 * Vector3d(0.0, 0.0, 50.0)}};
  core::ImageF range_m(90, 80, 1, 20.0F);
  const core::ImageF motion_px = flow_image(view0, past, range_m);
  EXPECT_TRUE(std::isnan(motion_px(45, 40, 0)));
  EXPECT_TRUE(std::isnan(motion_px(45, 40, 1)));
}

TEST_F(Labels, DisparityIsTheDifferenceOfTheTwoImages) {
  const auto left = geo::make_camera(info.cameras[0].intrinsics);
  const CameraView left_view{*left, test::tiny_world_from_camera(options, 0, info.cameras[0])};
  const CameraView right_view{*left, test::tiny_world_from_camera(options, 0, info.cameras[3])};
  const CameraFrame frame = test::tiny_frame(options, info, 0, 0);
  const core::ImageF disparity_px = disparity_image(*left, 0.5, frame.range_m);
  for (int y = 0; y < 80; y += 2) {
    for (int x = 0; x < 90; x += 2) {
      const double range_m = static_cast<double>(frame.range_m(x, y));
      if (std::isinf(range_m)) {
        EXPECT_EQ(disparity_px(x, y), 0.0F);
        continue;
      }
      const auto motion = flow(left_view, right_view, pixel_center(x, y), range_m);
      ASSERT_TRUE(motion);
      // A float's rounding, and 2e-11 px of the two poses.
      EXPECT_NEAR(static_cast<double>(disparity_px(x, y)), -motion->x(),
                  6e-8 * -motion->x() + 2e-11);
      EXPECT_NEAR(motion->y(), 0.0, 2e-11);
    }
  }
}

}  // namespace
}  // namespace terracast::capture
