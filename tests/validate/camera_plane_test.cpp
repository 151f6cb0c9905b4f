// The validator's models of cameras against OpenCV's, and against the publications' formulas in 64-bit mantissas. They
// share no code with the renderer's, which tests/geo holds so by tests of its own.

#include "validate/camera_plane.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "core/error.h"
#include "core/random.h"
#include "validate/geometry.h"
#include "validate/sampling.h"

namespace terracast::validate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Real = long double;
using Formula = std::function<std::array<Real, 2>(Real x, Real y, Real z)>;

constexpr std::uint64_t kSeed = 43;

/// Points within an angle of the axis, 0.1 m to 100 m away.
std::vector<Vector3d> points_within(double angle_rad) {
  std::vector<Vector3d> points;
  for (std::uint64_t i = 0; i < 500; ++i) {
    const double aside = angle_rad * std::sqrt(core::random_unit(kSeed, 1, i));
    const double around = 2.0 * std::numbers::pi * core::random_unit(kSeed, 2, i);
    points.push_back((0.1 + 99.9 * core::random_unit(kSeed, 3, i)) *
                     Vector3d(std::sin(aside) * std::cos(around),
                              std::sin(aside) * std::sin(around), std::cos(aside)));
  }
  return points;
}

/// Places are the formula's within some roundings, and their rays lead back to the points.
void expect_is(const std::string& model, const std::vector<double>& own, double angle_rad,
               const std::function<Vector2d(const Vector3d&)>& truth) {
  SCOPED_TRACE(model);
  const auto plane = make_camera_plane(model, own);
  for (const Vector3d& point : points_within(angle_rad)) {
    const auto place = plane->place_from_point(point);
    ASSERT_TRUE(place) << point.transpose();
    ASSERT_LT((*place - truth(point)).norm(), 4e-15 * (1.0 + place->norm())) << point.transpose();
    const Vector3d ray = plane->ray_from_place(*place);
    ASSERT_NEAR(ray.norm(), 1.0, 1e-15);
    const Vector3d origin = plane->origin_from_place(*place);
    // Of a place that is rounded; where images crowd at a rim that turns the ray by more.
    const double distance = (point - origin).dot(ray);
    ASSERT_LT((origin + distance * ray - point).norm(), 2e-12 * (1.0 + point.norm()))
        << point.transpose();
    ASSERT_NEAR(plane->distance_m(point), distance, 1e-12 * (1.0 + distance));
  }
}
void expect_formula(const std::string& model, const std::vector<double>& own, double angle_rad,
                    const Formula& formula) {
  expect_is(model, own, angle_rad, [&](const Vector3d& p) {
    const auto place = formula(p.x(), p.y(), p.z());
    return Vector2d(static_cast<double>(place[0]), static_cast<double>(place[1]));
  });
}

Vector2d by_opencv(const Vector3d& point, const std::vector<double>& distortion) {
  std::vector<cv::Point2d> result;
  cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, cv::Vec3d(),
                    cv::Vec3d(), cv::Mat::eye(3, 3, CV_64F), distortion, result);
  return {result[0].x, result[0].y};
}

TEST(CameraPlanes, OfPerspectiveAreOpenCvs) {
  const std::vector<double> full{0.3, -0.1, 3e-3, -2e-3, 0.02, 0.6, 0.1, 0.01};
  const auto expect = [](const std::string& model, const std::vector<double>& own,
                         std::vector<double> distortion) {
    expect_is(model, own, 0.6, [&](const Vector3d& p) { return by_opencv(p, distortion); });
  };
  expect("pinhole", {}, {0, 0, 0, 0});
  expect("simple_radial", {-0.21}, {-0.21, 0, 0, 0});
  expect("radial", {-0.21, 0.07}, {-0.21, 0.07, 0, 0});
  expect("opencv", {-0.21, 0.07, 3e-3, -2e-3}, {-0.21, 0.07, 3e-3, -2e-3});
  expect("full_opencv", full, full);
}

TEST(CameraPlanes, OfFisheyesAreOpenCvsAndGoOnBehindTheCamera) {
  expect_is("opencv_fisheye", {0.03, -0.012, 0.004, -0.0007}, 1.3, [](const Vector3d& p) {
    std::vector<cv::Vec2d> result;
    cv::fisheye::projectPoints(std::vector<cv::Vec3d>{{p.x(), p.y(), p.z()}}, result, cv::Vec3d(),
                               cv::Vec3d(), cv::Mat::eye(3, 3, CV_64F),
                               cv::Vec4d(0.03, -0.012, 0.004, -0.0007));
    return Vector2d(result[0][0], result[0][1]);
  });
  expect_formula("opencv_fisheye", {0.03, -0.012, 0.004, -0.0003}, 1.9, [](Real x, Real y, Real z) {
    const Real r = std::sqrt(x * x + y * y), t = std::atan2(r, z);
    const Real d = t + 0.03 * std::pow(t, Real(3)) - 0.012 * std::pow(t, Real(5)) +
                   0.004 * std::pow(t, Real(7)) - 0.0003 * std::pow(t, Real(9));
    return std::array<Real, 2>{d * x / r, d * y / r};
  });
  expect_formula("thin_prism_fisheye", {0.02, -0.01, 1e-3, -8e-4, 0.002, -0.0004, 1e-3, -2e-3}, 1.7,
                 [](Real x, Real y, Real z) {
                   const Real r = std::sqrt(x * x + y * y), t = std::atan2(r, z);
                   const Real u = t * x / r, v = t * y / r, u2 = u * u, v2 = v * v, r2 = u2 + v2;
                   const Real radial = 0.02 * r2 - 0.01 * r2 * r2 + 0.002 * r2 * r2 * r2 -
                                       0.0004 * r2 * r2 * r2 * r2;
                   return std::array<Real, 2>{
                       u + u * radial + 2 * 1e-3 * u * v - 8e-4 * (r2 + 2 * u2) + 1e-3 * r2,
                       v + v * radial - 2 * 8e-4 * u * v + 1e-3 * (r2 + 2 * v2) - 2e-3 * r2};
                 });
}

TEST(CameraPlanes, OfSpheresAreTheirPublications) {
  expect_formula("fov", {0.93}, 1.4, [](Real x, Real y, Real z) {
    const Real r = std::sqrt(x * x + y * y);
    const Real d = std::atan(2 * r / z * std::tan(Real(0.93) / 2)) / Real(0.93);
    return std::array<Real, 2>{d * x / r, d * y / r};
  });
  for (const double xi : {0.7, 1.0, 1.4})
    expect_formula("unified", {xi, -0.1, 0.02, 1e-3, -8e-4}, 1.4, [xi](Real x, Real y, Real z) {
      const Real n = std::sqrt(x * x + y * y + z * z);
      const Real u = x / (z + xi * n), v = y / (z + xi * n), r2 = u * u + v * v;
      const Real radial = 1 - Real(0.1) * r2 + Real(0.02) * r2 * r2;
      return std::array<Real, 2>{
          u * radial + 2 * Real(1e-3) * u * v - Real(8e-4) * (r2 + 2 * u * u),
          v * radial + Real(1e-3) * (r2 + 2 * v * v) - 2 * Real(8e-4) * u * v};
    });
  for (const double alpha : {0.0, 0.4, 0.5, 0.65})
    expect_formula("extended_unified", {alpha, 1.2}, alpha > 0.0 ? 1.7 : 1.4,
                   [alpha](Real x, Real y, Real z) {
                     const Real d = std::sqrt(Real(1.2) * (x * x + y * y) + z * z);
                     const Real below = alpha * d + (1 - Real(alpha)) * z;
                     return std::array<Real, 2>{x / below, y / below};
                   });
  for (const double xi : {-0.25, 0.0, 0.3})
    expect_formula("double_sphere", {xi, 0.6}, 1.5, [xi](Real x, Real y, Real z) {
      const Real d1 = std::sqrt(x * x + y * y + z * z), w = xi * d1 + z;
      const Real below = Real(0.6) * std::sqrt(x * x + y * y + w * w) + (1 - Real(0.6)) * w;
      return std::array<Real, 2>{x / below, y / below};
    });
}

TEST(CameraPlanes, OfPanoramasAndParallelRaysAreTheirDefinitions) {
  expect_formula("equirectangular", {}, 3.0, [](Real x, Real y, Real z) {
    return std::array<Real, 2>{std::atan2(x, z), std::asin(y / std::sqrt(x * x + y * y + z * z))};
  });
  expect_formula("cylindrical", {}, 1.2, [](Real x, Real y, Real z) {
    return std::array<Real, 2>{std::atan2(x, z), y / std::sqrt(x * x + z * z)};
  });
  expect_formula("orthographic", {}, 1.4, [](Real x, Real y, Real) {
    return std::array<Real, 2>{x, y};
  });
  expect_formula("pushbroom", {}, 1.2, [](Real x, Real y, Real z) {
    return std::array<Real, 2>{x / z, y};
  });
  EXPECT_FALSE(make_camera_plane("equirectangular", {})->place_from_point({0.0, 1.0, 0.0}));
  EXPECT_FALSE(make_camera_plane("orthographic", {})->place_from_point({0.0, 0.0, -1.0}));
}

TEST(CameraPlanes, EndWhereImagesWouldFold) {
  /// The farthest angle from the axis, towards x, that is seen.
  const auto rim_of = [](const std::string& model, const std::vector<double>& own) {
    const auto plane = make_camera_plane(model, own);
    double inside = 0.0, outside = std::numbers::pi;
    while (outside - inside > 1e-12) {
      const double middle = 0.5 * (inside + outside);
      (plane->place_from_point({std::sin(middle), 0.0, std::cos(middle)}) ? inside : outside) =
          middle;
    }
    return inside;
  };
  const double quarter = 0.5 * std::numbers::pi;
  EXPECT_NEAR(rim_of("simple_radial", {-0.3}), std::atan(1.0 / std::sqrt(0.9)), 1e-9);
  EXPECT_NEAR(rim_of("opencv_fisheye", {-0.1, 0, 0, 0}), std::sqrt(1.0 / 0.3), 1e-9);
  EXPECT_NEAR(rim_of("pinhole", {}), quarter, 1e-9);
  EXPECT_NEAR(rim_of("fov", {0.9}), quarter, 1e-9);
  EXPECT_NEAR(rim_of("opencv_fisheye", {0, 0, 0, 0}), std::numbers::pi, 1e-9);
  EXPECT_NEAR(rim_of("unified", {0.5, 0, 0, 0, 0}), std::acos(-0.5), 1e-9);
  EXPECT_NEAR(rim_of("unified", {2.0, 0, 0, 0, 0}), std::acos(-0.5), 1e-6);
  EXPECT_NEAR(rim_of("extended_unified", {0.75, 1.0}), std::acos(-1.0 / 3.0), 1e-6);
  const auto barrel = make_camera_plane("simple_radial", {-0.3});
  const double farthest = 2.0 / 3.0 / std::sqrt(0.9);  // r + k r³ at r = 1 / sqrt(-3 k)
  EXPECT_TRUE(barrel->ray_from_place({farthest - 1e-6, 0.0}).allFinite());
  EXPECT_FALSE(barrel->ray_from_place({farthest + 1e-6, 0.0}).allFinite());
}

/// A wide table, as text files have it: rays of any length.
std::vector<double> table_of(int columns, int rows) {
  std::vector<double> own{static_cast<double>(columns), static_cast<double>(rows)};
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const double x = 1.9 * (i / (columns - 1.0) - 0.5), y = 1.4 * (j / (rows - 1.0) - 0.5);
      const double length = 0.5 + core::random_unit(kSeed, 4, static_cast<std::uint64_t>(i));
      own.insert(own.end(), {length * std::sin(x + 0.02 * y * y), length * std::sin(y),
                             length * std::cos(x) * std::cos(y)});
    }
  return own;
}

TEST(CameraPlanes, OfTablesJoinTheirNodesByCubics) {
  constexpr int kColumns = 9, kRows = 7;
  const std::vector<double> own = table_of(kColumns, kRows);
  const auto plane = make_camera_plane("tabulated", own);
  const auto node = [&](int i, int j, int axis) {
    const auto at = static_cast<std::size_t>(2 + 3 * (j * kColumns + i));
    const Real x = own[at], y = own[at + 1], z = own[at + 2];
    return std::array<Real, 3>{x, y, z}[static_cast<std::size_t>(axis)] /
           std::sqrt(x * x + y * y + z * z);
  };
  for (std::uint64_t k = 0; k < 300; ++k) {
    const Vector2d place(1.0 + (kColumns - 3) * core::random_unit(kSeed, 5, k),
                         1.0 + (kRows - 3) * core::random_unit(kSeed, 6, k));
    // Catmull and Rom along each of four rows, then across them.
    const int i = static_cast<int>(place.x()), j = static_cast<int>(place.y());
    const auto cubic = [](const std::array<Real, 4>& p, Real t) {
      return p[1] + t / 2 *
                        (p[2] - p[0] +
                         t * (2 * p[0] - 5 * p[1] + 4 * p[2] - p[3] +
                              t * (3 * (p[1] - p[2]) + p[3] - p[0])));
    };
    Eigen::Vector3d ray;
    for (int axis = 0; axis < 3; ++axis) {
      std::array<Real, 4> rows{};
      for (int b = 0; b < 4; ++b)
        rows[static_cast<std::size_t>(b)] =
            cubic({node(i - 1, j - 1 + b, axis), node(i, j - 1 + b, axis),
                   node(i + 1, j - 1 + b, axis), node(i + 2, j - 1 + b, axis)},
                  place.x() - i);
      ray[axis] = static_cast<double>(cubic(rows, place.y() - j));
    }
    ray.normalize();
    ASSERT_LT((plane->ray_from_place(place) - ray).norm(), 1e-15) << place.transpose();
    const auto back = plane->place_from_point(37.0 * ray);
    ASSERT_TRUE(back) << place.transpose();
    ASSERT_LT((*back - place).norm(), 1e-12);
  }
  // Half a step beyond the nodes, and no farther.
  const Vector3d beyond = plane->ray_from_place({-0.4, 3.2});
  EXPECT_LT((*plane->place_from_point(beyond) - Vector2d(-0.4, 3.2)).norm(), 1e-12);
  EXPECT_FALSE(plane->ray_from_place({-0.6, 3.2}).allFinite());
  EXPECT_FALSE(plane->place_from_point({0.0, 0.0, -1.0}));
}

TEST(CameraPlanes, DerivativesAreThoseOfThePinhole) {
  Intrinsics closed{640, 480, 320.0, 310.0, 322.0, 241.0};
  Intrinsics wide = closed;
  wide.plane = make_camera_plane("pinhole", {});
  for (const Vector3d& point : points_within(0.8)) {
    const Eigen::Matrix<double, 2, 3> truth = projection_jacobian(closed, point);
    ASSERT_LT((projection_jacobian(wide, point) - truth).norm(), 1e-8 * truth.norm());
    // Of a point at a fixed distance: the projection undoes it.
    const Vector2d pixel = wide.pixel_from_point(point);
    const Eigen::Matrix<double, 3, 2> back = unprojection_jacobian(wide, pixel, point.norm());
    ASSERT_LT((truth * back - Eigen::Matrix2d::Identity()).norm(), 1e-7);
    ASSERT_LT((point.transpose() * back).norm(), 1e-6 * point.squaredNorm());
  }
}

TEST(CameraPlanes, RefuseWhatIsNoCamera) {
  const auto refused = [](const std::string& model, const std::vector<double>& own) {
    EXPECT_THROW(make_camera_plane(model, own), core::Error) << model;
  };
  refused("pinhole", {1.0});
  refused("fish", {});
  refused("fov", {4.0});
  refused("double_sphere", {0.0, 1.5});
  refused("opencv", {0.0, 0.0, NAN, 0.0});
  refused("tabulated", {});
  refused("tabulated", {4.0, 4.0, 1.0});
  refused("tabulated", {4.5, 4.0});
  std::vector<double> rays(2 + 48, 0.0);
  rays[0] = rays[1] = 4.0;
  refused("tabulated", rays);
  std::fill(rays.begin() + 2, rays.end(), 1.0);
  rays[7] = 1e200;
  refused("tabulated", rays);
}

// Whatever numbers files hold, a ray has length 1 and starts no farther off than the Earth is wide, or there is none.
TEST(CameraPlanes, OfHostileNumbersHaveUnitRaysOrNone) {
  std::vector<double> opposed = {4.0, 4.0};  // nodes that cancel between them
  for (int i = 0; i < 16; ++i)
    for (const double value : {i % 2 == 0 ? 1.0 : -1.0, 0.0, 0.0}) opposed.push_back(value);
  const std::vector<std::pair<std::string, std::vector<double>>> models = {
      {"pinhole", {}},
      {"opencv", {1e150, -1e150, 1e100, 1e100}},
      {"opencv_fisheye", {1e200, 0.0, 0.0, 0.0}},
      {"fov", {1e-6}},
      {"unified", {1e3, 1e100, 0.0, 0.0, 0.0}},
      {"extended_unified", {1.0, 1e9}},
      {"double_sphere", {1e3, 1.0}},
      {"equirectangular", {}},
      {"cylindrical", {}},
      {"orthographic", {}},
      {"pushbroom", {}},
      {"tabulated", opposed}};
  int num_rays = 0, num_none = 0;
  for (const auto& [model, own] : models)
    for (const double fx_px : {1e-308, 1e-200, 1e-25, 1e-7, 100.0, 1e200})
      for (const double fy_px : {1e-308, 1e-200, 1e-25, 1e-7, 100.0, 1e200})
        for (const Vector2d& pixel :
             {Vector2d(0.0, 0.0), Vector2d(32.5, 10.5), Vector2d(64.0, 48.0)}) {
          Intrinsics camera{64, 48, fx_px, fy_px, 32.0, 24.0};
          camera.plane = make_camera_plane(model, own);
          const Vector3d ray = camera.ray_from_pixel(pixel);
          SCOPED_TRACE(fmt::format("{}, {}, {}", model, fx_px, fy_px));
          if (!ray.allFinite()) {
            ASSERT_TRUE(ray.array().isNaN().any());
            ++num_none;
            continue;
          }
          ++num_rays;
          ASSERT_NEAR(ray.norm(), 1.0, 1e-9);
          const Vector3d origin = camera.origin_from_pixel(pixel);
          ASSERT_LT(origin.norm(), 3e7);
        }
  EXPECT_GT(num_rays, 100);
  EXPECT_GT(num_none, 100);
}

}  // namespace
}  // namespace terracast::validate
