// Cameras held against OpenCV's own, and against formulas written out here once more as their
// publications have them, in long double. OpenCV counts pixels from their centres.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "core/random.h"
#include "geo/camera_model.h"

namespace terracast::geo {
namespace {

using Real = long double;
using Plane = std::array<Real, 2>;

constexpr std::uint64_t kSeed = 41;
constexpr double kFx = 512.25, kFy = 498.5, kCx = 371.3, kCy = 318.9;

/// Rays within an angle of the axis, of any length.
std::vector<Eigen::Vector3d> rays_within(double angle_rad) {
  std::vector<Eigen::Vector3d> rays;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const double from_axis = angle_rad * std::sqrt(core::random_unit(kSeed, 1, i));
    const double around = core::random_between(0, 2 * std::numbers::pi, kSeed, 2, i);
    rays.push_back(core::random_between(0.1, 100.0, kSeed, 3, i) *
                   Eigen::Vector3d(std::sin(from_axis) * std::cos(around),
                                   std::sin(from_axis) * std::sin(around), std::cos(from_axis)));
  }
  return rays;
}

std::unique_ptr<CameraModel> camera_of(const std::string& model, const std::vector<double>& own) {
  std::vector<double> parameters{kFx, kFy, kCx, kCy};
  parameters.insert(parameters.end(), own.begin(), own.end());
  return make_camera({model, 720, 640, parameters});
}

/// Rays project alike: within what doubles of some hundred pixels are rounded by, some ten times over.
void expect_same(const CameraModel& camera, const std::vector<Eigen::Vector3d>& rays,
                 const std::function<Eigen::Vector2d(const Eigen::Vector3d&)>& other) {
  for (const Eigen::Vector3d& ray : rays) {
    const auto pixel = camera.pixel_from_ray(ray);
    ASSERT_TRUE(pixel) << ray.transpose();
    const Eigen::Vector2d expected = other(ray);
    ASSERT_LT((*pixel - expected).norm(), kPixelRounding * (960.0 + expected.norm()))
        << ray.transpose();
  }
}

cv::Mat opencv_matrix() {
  return (cv::Mat_<double>(3, 3) << kFx, 0, kCx - 0.5, 0, kFy, kCy - 0.5, 0, 0, 1);
}

Eigen::Vector2d by_opencv(const Eigen::Vector3d& ray, const std::vector<double>& distortion) {
  const std::vector<cv::Point3d> points{{ray.x(), ray.y(), ray.z()}};
  std::vector<cv::Point2d> pixels;
  const cv::Vec3d none(0, 0, 0);
  cv::projectPoints(points, none, none, opencv_matrix(), distortion, pixels);
  return {pixels[0].x + 0.5, pixels[0].y + 0.5};
}

Eigen::Vector2d by_opencv_fisheye(const Eigen::Vector3d& ray, const cv::Vec4d& distortion) {
  const std::vector<cv::Vec3d> points{{ray.x(), ray.y(), ray.z()}};
  std::vector<cv::Vec2d> pixels;
  const cv::Vec3d none(0, 0, 0);
  cv::fisheye::projectPoints(points, pixels, none, none, opencv_matrix(), distortion);
  return {pixels[0][0] + 0.5, pixels[0][1] + 0.5};
}

Eigen::Vector2d pixel_of(const Plane& place) {
  return {static_cast<double>(kFx * place[0] + kCx), static_cast<double>(kFy * place[1] + kCy)};
}

TEST(OpenCvCameras, ProjectPointsHasTheBrownConradyFamily) {
  const auto rays = rays_within(0.6);
  expect_same(*camera_of("pinhole", {}), rays, [](const auto& ray) {
    return by_opencv(ray, {0, 0, 0, 0});
  });
  expect_same(*camera_of("simple_radial", {-0.21}), rays, [](const auto& ray) {
    return by_opencv(ray, {-0.21, 0, 0, 0});
  });
  expect_same(*camera_of("radial", {-0.21, 0.07}), rays, [](const auto& ray) {
    return by_opencv(ray, {-0.21, 0.07, 0, 0});
  });
  expect_same(*camera_of("opencv", {-0.21, 0.07, 3e-3, -2e-3}), rays, [](const auto& ray) {
    return by_opencv(ray, {-0.21, 0.07, 3e-3, -2e-3});
  });
  const std::vector<double> full{0.3, -0.1, 3e-3, -2e-3, 0.02, 0.6, 0.1, 0.01};
  expect_same(*camera_of("full_opencv", full), rays,
              [&](const auto& ray) { return by_opencv(ray, full); });
}

TEST(OpenCvCameras, UndistortPointsFindsTheSameRays) {
  const auto camera = camera_of("opencv", {-0.21, 0.07, 3e-3, -2e-3});
  for (std::uint64_t i = 0; i < 500; ++i) {
    const Eigen::Vector2d pixel(core::random_between(0, 720, kSeed, 4, i),
                                core::random_between(0, 640, kSeed, 5, i));
    const std::vector<cv::Point2d> pixels{{pixel.x() - 0.5, pixel.y() - 0.5}};
    std::vector<cv::Point2d> places;
    cv::undistortPoints(
        pixels, places, opencv_matrix(), std::vector<double>{-0.21, 0.07, 3e-3, -2e-3},
        cv::noArray(), cv::noArray(),
        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-13));
    const Eigen::Vector3d ray = camera->ray_from_pixel(pixel);
    // Its fixed point stops at 1e-13 px of its own miss.
    ASSERT_NEAR(ray.x(), places[0].x, 1e-12);
    ASSERT_NEAR(ray.y(), places[0].y, 1e-12);
  }
}

TEST(OpenCvCameras, FisheyeHasKannalaBrandt) {
  expect_same(*camera_of("opencv_fisheye", {0.03, -0.012, 0.004, -0.0007}), rays_within(1.4),
              [](const auto& ray) {
                return by_opencv_fisheye(ray, {0.03, -0.012, 0.004, -0.0007});
              });
}

// Their polynomial of the angle beyond a half-space, which OpenCV's division by z cannot say.
TEST(PublishedCameras, KannalaBrandtGoesOnBehindTheCamera) {
  expect_same(*camera_of("opencv_fisheye", {0.03, -0.012, 0.004, -0.0003}), rays_within(1.9),
              [](const Eigen::Vector3d& ray) {
                const Real x = ray.x(), y = ray.y(), z = ray.z();
                const Real r = std::sqrt(x * x + y * y);
                const Real t = std::acos(z / std::sqrt(x * x + y * y + z * z));
                const Real d = t + 0.03 * std::pow(t, Real(3)) - 0.012 * std::pow(t, Real(5)) +
                               0.004 * std::pow(t, Real(7)) - 0.0003 * std::pow(t, Real(9));
                return pixel_of({d * x / r, d * y / r});
              });
}

TEST(PublishedCameras, ThinPrismFisheyeIsThatOfColmap) {
  constexpr Real k1 = 0.02, k2 = -0.01, p1 = 1e-3, p2 = -8e-4, k3 = 0.002, k4 = -0.0004, sx = 1e-3,
                 sy = -2e-3;
  expect_same(
      *camera_of("thin_prism_fisheye", {0.02, -0.01, 1e-3, -8e-4, 0.002, -0.0004, 1e-3, -2e-3}),
      rays_within(1.4), [](const Eigen::Vector3d& ray) {
        const Real a = Real(ray.x()) / ray.z(), b = Real(ray.y()) / ray.z();
        const Real r = std::sqrt(a * a + b * b);
        const Real u = std::atan(r) * a / r, v = std::atan(r) * b / r;
        const Real u2 = u * u, v2 = v * v, r2 = u2 + v2;
        const Real radial = k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2 + k4 * r2 * r2 * r2 * r2;
        return pixel_of({u + u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u2) + sx * r2,
                         v + v * radial + 2 * p2 * u * v + p1 * (r2 + 2 * v2) + sy * r2});
      });
}

TEST(PublishedCameras, FovIsThatOfDevernayAndFaugeras) {
  expect_same(*camera_of("fov", {0.93}), rays_within(1.4), [](const Eigen::Vector3d& ray) {
    const Real a = Real(ray.x()) / ray.z(), b = Real(ray.y()) / ray.z();
    const Real r = std::sqrt(a * a + b * b);
    const Real d = std::atan(2 * r * std::tan(Real(0.93) / 2)) / Real(0.93);
    return pixel_of({d / r * a, d / r * b});
  });
}

// To the unit sphere, from its shifted centre on a plane, distorted there: steps 1 to 5 of the paper.
TEST(PublishedCameras, UnifiedIsThatOfMeiAndRives) {
  for (const double xi : {0.7, 1.0, 1.4}) {
    expect_same(*camera_of("unified", {xi, -0.1, 0.02, 1e-3, -8e-4}), rays_within(1.4),
                [xi](const Eigen::Vector3d& ray) {
                  const Real n = std::sqrt(Real(ray.x()) * ray.x() + Real(ray.y()) * ray.y() +
                                           Real(ray.z()) * ray.z());
                  const Real x = ray.x() / n / (ray.z() / n + xi),
                             y = ray.y() / n / (ray.z() / n + xi);
                  const Real r2 = x * x + y * y, radial = 1 - 0.1 * r2 + 0.02 * r2 * r2;
                  return pixel_of({x * radial + 2 * 1e-3 * x * y - 8e-4 * (r2 + 2 * x * x),
                                   y * radial + 1e-3 * (r2 + 2 * y * y) - 2 * 8e-4 * x * y});
                });
  }
}

TEST(PublishedCameras, ExtendedUnifiedIsThatOfKhomutenko) {
  for (const double alpha : {0.0, 0.4, 0.5, 0.65}) {
    expect_same(*camera_of("extended_unified", {alpha, 1.2}), rays_within(alpha > 0 ? 1.7 : 1.4),
                [alpha](const Eigen::Vector3d& ray) {
                  const Real x = ray.x(), y = ray.y(), z = ray.z();
                  const Real rho = std::sqrt(Real(1.2) * (x * x + y * y) + z * z);
                  const Real below = alpha * rho + (1 - Real(alpha)) * z;
                  return pixel_of({x / below, y / below});
                });
  }
}

TEST(PublishedCameras, DoubleSphereIsThatOfUsenko) {
  for (const double xi : {-0.25, 0.0, 0.3}) {
    expect_same(*camera_of("double_sphere", {xi, 0.6}), rays_within(1.5),
                [xi](const Eigen::Vector3d& ray) {
                  const Real x = ray.x(), y = ray.y(), z = ray.z();
                  const Real d1 = std::sqrt(x * x + y * y + z * z);
                  const Real d2 = std::sqrt(x * x + y * y + (xi * d1 + z) * (xi * d1 + z));
                  const Real below = Real(0.6) * d2 + (1 - Real(0.6)) * (xi * d1 + z);
                  return pixel_of({x / below, y / below});
                });
  }
}

// One family at its common member: xi of the unified model is alpha / (1 - alpha) of the others'.
TEST(PublishedCameras, TheUnifiedModelsMeet) {
  const auto unified = make_camera({"unified", 720, 640, {300, 300, 360, 320, 1.5, 0, 0, 0, 0}});
  const double scale = 300 / 2.5;  // 1 + xi
  const auto extended =
      make_camera({"extended_unified", 720, 640, {scale, scale, 360, 320, 0.6, 1}});
  const auto sphere = make_camera({"double_sphere", 720, 640, {scale, scale, 360, 320, 0, 0.6}});
  for (const Eigen::Vector3d& ray : rays_within(1.6)) {
    const Eigen::Vector2d pixel = *unified->pixel_from_ray(ray);
    EXPECT_LT((pixel - *extended->pixel_from_ray(ray)).norm(), 1e-10);
    EXPECT_LT((pixel - *sphere->pixel_from_ray(ray)).norm(), 1e-10);
  }
}

TEST(PublishedCameras, PanoramasAreAnglesAndCylinders) {
  const auto all_around =
      make_camera({"equirectangular",
                   3600,
                   1800,
                   {1800 / std::numbers::pi, 1800 / std::numbers::pi, 1800, 900}});
  const auto cylinder =
      make_camera({"cylindrical", 3600, 1800, {1800 / std::numbers::pi, 500, 1800, 900}});
  for (const double azimuth_deg : {-170.0, -90.0, -1.0, 0.0, 45.0, 90.0, 179.0}) {
    for (const double elevation_deg : {-80.0, -30.0, 0.0, 10.0, 60.0}) {
      const double azimuth = azimuth_deg * std::numbers::pi / 180;
      const double elevation = elevation_deg * std::numbers::pi / 180;
      const Eigen::Vector3d ray(std::cos(elevation) * std::sin(azimuth), -std::sin(elevation),
                                std::cos(elevation) * std::cos(azimuth));
      // A tenth of a degree a pixel.
      const Eigen::Vector2d pixel = *all_around->pixel_from_ray(3.0 * ray);
      EXPECT_NEAR(pixel.x(), 1800 + 10 * azimuth_deg, 1e-10);
      EXPECT_NEAR(pixel.y(), 900 - 10 * elevation_deg, 1e-10);
      const Eigen::Vector2d unrolled = *cylinder->pixel_from_ray(3.0 * ray);
      EXPECT_NEAR(unrolled.x(), 1800 + 10 * azimuth_deg, 1e-10);
      EXPECT_NEAR(unrolled.y(), 900 - 500 * std::tan(elevation), 1e-9);
    }
  }
  EXPECT_FALSE(all_around->pixel_from_ray({0.0, 1.0, 0.0}));
  EXPECT_FALSE(cylinder->ray_from_pixel({3601.0, 900.0}).allFinite());
}

TEST(PublishedCameras, ParallelRaysAndScannedLines) {
  const auto map = make_camera({"orthographic", 200, 100, {4, 5, 100, 50}});
  EXPECT_FALSE(map->is_central());
  for (const double z : {1.0, 1e4}) {
    EXPECT_EQ(*map->pixel_from_ray({2.5, -3.0, z}), Eigen::Vector2d(110, 35));
  }
  EXPECT_EQ(map->origin_from_pixel({110, 35}), Eigen::Vector3d(2.5, -3.0, 0.0));
  EXPECT_EQ(map->finest_pixels_per_m(), 5.0);
  EXPECT_FALSE(map->pixel_from_ray({0.0, 0.0, -1.0}));

  const auto scanner = make_camera({"pushbroom", 200, 100, {100, 5, 100, 50}});
  EXPECT_FALSE(scanner->is_central());
  EXPECT_EQ(*scanner->pixel_from_ray({100.0, -3.0, 200.0}), Eigen::Vector2d(150, 35));
  EXPECT_EQ(scanner->origin_from_pixel({150, 35}), Eigen::Vector3d(0.0, -3.0, 0.0));
  EXPECT_EQ(scanner->ray_from_pixel({150, 35}), Eigen::Vector3d(0.5, 0.0, 1.0));
  EXPECT_EQ(scanner->finest_pixels_per_m(), 5.0);
  EXPECT_DOUBLE_EQ(scanner->finest_pixels_per_radian(), 100.0 * 2.0);
  EXPECT_FALSE(scanner->pixel_from_ray({0.0, 0.0, -1.0}));
}

/// The farthest angle from the axis, towards x, that projects.
double rim_of(const CameraModel& camera) {
  double inside = 0.0, outside = std::numbers::pi;
  while (outside - inside > 1e-12) {
    const double middle = 0.5 * (inside + outside);
    (camera.pixel_from_ray({std::sin(middle), 0.0, std::cos(middle)}) ? inside : outside) = middle;
  }
  return inside;
}

TEST(CameraDomains, EndWhereImagesWouldFold) {
  // r + k r^3 grows up to r = 1 / sqrt(-3 k).
  const auto barrel = camera_of("simple_radial", {-0.3});
  EXPECT_NEAR(rim_of(*barrel), std::atan(1.0 / std::sqrt(0.9)), 1e-9);
  // What lies beyond its largest radius, 2 / 3 r, no ray comes to.
  const double farthest_px = kFx * 2.0 / 3.0 / std::sqrt(0.9);
  EXPECT_TRUE(barrel->ray_from_pixel({kCx + farthest_px - 1e-3, kCy}).allFinite());
  EXPECT_FALSE(barrel->ray_from_pixel({kCx + farthest_px + 1e-3, kCy}).allFinite());
  EXPECT_NEAR(rim_of(*camera_of("opencv_fisheye", {-0.1, 0, 0, 0})), std::sqrt(1.0 / 0.3), 1e-9);

  const double quarter = 0.5 * std::numbers::pi;
  EXPECT_NEAR(rim_of(*camera_of("pinhole", {})), quarter, 1e-9);
  EXPECT_NEAR(rim_of(*camera_of("simple_radial", {0.1})), quarter, 1e-9);
  EXPECT_NEAR(rim_of(*camera_of("fov", {0.9})), quarter, 1e-9);
  EXPECT_NEAR(rim_of(*camera_of("opencv_fisheye", {0, 0, 0, 0})), std::numbers::pi, 1e-9);
  // The sphere is seen from xi: up to the horizon behind, or to where rays touch it.
  EXPECT_NEAR(rim_of(*camera_of("unified", {0.5, 0, 0, 0, 0})), std::acos(-0.5), 1e-9);
  EXPECT_NEAR(rim_of(*camera_of("unified", {2.0, 0, 0, 0, 0})), std::acos(-0.5), 1e-6);
  EXPECT_NEAR(rim_of(*camera_of("extended_unified", {0.75, 1.0})), std::acos(-1.0 / 3.0), 1e-6);
}

}  // namespace
}  // namespace terracast::geo
