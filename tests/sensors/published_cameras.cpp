#include "tests/sensors/published_cameras.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace terracast::test {
namespace {

using Real = PublishedCamera::Real;
using Plane = PublishedCamera::Plane;
using Point = PublishedCamera::Point;
using Parameters = std::vector<double>;
using Eigen::Vector2d;
using Eigen::Vector3d;

Plane in_image(Real x, Real y, const Parameters& p) { return {p[0] * x + p[2], p[1] * y + p[3]}; }

Real length_of(const Point& p) { return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }

// Hartley and Zisserman (2004), 6.1.
Plane pinhole(const Point& p, const Parameters& k) { return in_image(p[0] / p[2], p[1] / p[2], k); }

/// Brown's distortion (1966) of a place on a plane, with Conrady's tangential part as OpenCV has it.
Plane brown(Real x, Real y, Real k1, Real k2, Real p1, Real p2, const Parameters& k) {
  const Real r2 = x * x + y * y;
  const Real radial = 1 + k1 * r2 + k2 * r2 * r2;
  return in_image(x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                  y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y, k);
}
Plane simple_radial(const Point& p, const Parameters& k) {
  return brown(p[0] / p[2], p[1] / p[2], k[4], 0, 0, 0, k);
}
Plane radial(const Point& p, const Parameters& k) {
  return brown(p[0] / p[2], p[1] / p[2], k[4], k[5], 0, 0, k);
}
Plane opencv(const Point& p, const Parameters& k) {
  return brown(p[0] / p[2], p[1] / p[2], k[4], k[5], k[6], k[7], k);
}
// OpenCV's calib3d: k1, k2, p1, p2, k3, k4, k5, k6.
Plane full_opencv(const Point& p, const Parameters& k) {
  const Real x = p[0] / p[2], y = p[1] / p[2], r2 = x * x + y * y;
  const Real radial = (1 + k[4] * r2 + k[5] * r2 * r2 + k[8] * r2 * r2 * r2) /
                      (1 + k[9] * r2 + k[10] * r2 * r2 + k[11] * r2 * r2 * r2);
  return in_image(x * radial + 2 * k[6] * x * y + k[7] * (r2 + 2 * x * x),
                  y * radial + k[6] * (r2 + 2 * y * y) + 2 * k[7] * x * y, k);
}

// Kannala and Brandt (2006), with OpenCV's parameters.
Plane opencv_fisheye(const Point& p, const Parameters& k) {
  const Real r = std::sqrt(p[0] * p[0] + p[1] * p[1]);
  if (r == 0) return in_image(0, 0, k);
  const Real t = std::acos(p[2] / length_of(p)), t2 = t * t;
  const Real d = t * (1 + t2 * (k[4] + t2 * (k[5] + t2 * (k[6] + t2 * k[7]))));
  return in_image(d * p[0] / r, d * p[1] / r, k);
}

// Weng, Cohen and Herniou (1992) on a fisheye, with COLMAP's parameters: k1, k2, p1, p2, k3, k4, sx1, sy1.
Plane thin_prism_fisheye(const Point& p, const Parameters& k) {
  const Real r = std::sqrt(p[0] * p[0] + p[1] * p[1]);
  if (r == 0) return in_image(0, 0, k);
  const Real t = std::acos(p[2] / length_of(p));
  const Real u = t * p[0] / r, v = t * p[1] / r, r2 = t * t;
  const Real radial = r2 * (k[4] + r2 * (k[5] + r2 * (k[8] + r2 * k[9])));
  return in_image(u + u * radial + 2 * k[6] * u * v + k[7] * (r2 + 2 * u * u) + k[10] * r2,
                  v + v * radial + 2 * k[7] * u * v + k[6] * (r2 + 2 * v * v) + k[11] * r2, k);
}

// Devernay and Faugeras (2001).
Plane fov(const Point& p, const Parameters& k) {
  const Real r = std::sqrt(p[0] * p[0] + p[1] * p[1]);
  if (r == 0) return in_image(0, 0, k);
  const Real omega = k[4];
  const Real d = std::atan(2 * (r / p[2]) * std::tan(omega / 2)) / omega;
  return in_image(d * p[0] / r, d * p[1] / r, k);
}

// Mei and Rives (2007): to the unit sphere, from its shifted centre on a plane, distorted there.
Plane unified(const Point& p, const Parameters& k) {
  const Real n = length_of(p), below = p[2] / n + k[4];
  return brown(p[0] / n / below, p[1] / n / below, k[5], k[6], k[7], k[8], k);
}

// Khomutenko, Garcia and Martinet (2016).
Plane extended_unified(const Point& p, const Parameters& k) {
  const Real rho = std::sqrt(k[5] * (p[0] * p[0] + p[1] * p[1]) + p[2] * p[2]);
  const Real below = k[4] * rho + (1 - Real(k[4])) * p[2];
  return in_image(p[0] / below, p[1] / below, k);
}

// Usenko, Demmel and Cremers (2018).
Plane double_sphere(const Point& p, const Parameters& k) {
  const Real xi = k[4], alpha = k[5], d1 = length_of(p), z2 = xi * d1 + p[2];
  const Real d2 = std::sqrt(p[0] * p[0] + p[1] * p[1] + z2 * z2);
  const Real below = alpha * d2 + (1 - alpha) * z2;
  return in_image(p[0] / below, p[1] / below, k);
}

// Snyder (1987), the equidistant cylindrical projection of directions; Szeliski (2006), the cylinder.
Plane equirectangular(const Point& p, const Parameters& k) {
  return in_image(std::atan2(p[0], p[2]), std::asin(p[1] / length_of(p)), k);
}
Plane cylindrical(const Point& p, const Parameters& k) {
  return in_image(std::atan2(p[0], p[2]), p[1] / std::hypot(p[0], p[2]), k);
}

PublishedRay equirectangular_ray(const Vector2d& pixel, const Parameters& k) {
  const double longitude = (pixel.x() - k[2]) / k[0], latitude = (pixel.y() - k[3]) / k[1];
  return {Vector3d::Zero(),
          {std::cos(latitude) * std::sin(longitude), std::sin(latitude),
           std::cos(latitude) * std::cos(longitude)}};
}
PublishedRay cylindrical_ray(const Vector2d& pixel, const Parameters& k) {
  const double turn = (pixel.x() - k[2]) / k[0];
  return {Vector3d::Zero(),
          Vector3d(std::sin(turn), (pixel.y() - k[3]) / k[1], std::cos(turn)).normalized()};
}

// Hartley and Zisserman (2004), 6.3.1: a camera at infinity.
Plane orthographic(const Point& p, const Parameters& k) { return in_image(p[0], p[1], k); }
PublishedRay orthographic_ray(const Vector2d& pixel, const Parameters& k) {
  return {{(pixel.x() - k[2]) / k[0], (pixel.y() - k[3]) / k[1], 0.0}, Vector3d::UnitZ()};
}

// Gupta and Hartley (1997): across the way perspective, along it the time that passes.
Plane pushbroom(const Point& p, const Parameters& k) { return in_image(p[0] / p[2], p[1], k); }
PublishedRay pushbroom_ray(const Vector2d& pixel, const Parameters& k) {
  return {{0.0, (pixel.y() - k[3]) / k[1], 0.0},
          Vector3d((pixel.x() - k[2]) / k[0], 0.0, 1.0).normalized()};
}

/// Cubic convolution of Keys (1981), equation 15.
Real keys(Real s) {
  s = std::abs(s);
  if (s < 1) return ((3 * s - 5) * s * s + 2) / 2;
  if (s < 2) return (((-s + 5) * s - 8) * s + 4) / 2;
  return 0;
}

/// Schoeps et al. (2020): a ray for each node of a grid, here cubic in between.
Point tabulated_ray(Real u, Real v, const Parameters& k) {
  const Real place_x = (u - k[2]) / k[0], place_y = (v - k[3]) / k[1];
  const auto columns = static_cast<int>(k[4]), rows = static_cast<int>(k[5]);
  const auto column = static_cast<int>(std::floor(place_x));
  const auto row = static_cast<int>(std::floor(place_y));
  std::array<Real, 4> across, down;
  for (int i = 0; i < 4; ++i) {
    across[static_cast<std::size_t>(i)] = keys(place_x - (column - 1 + i));
    down[static_cast<std::size_t>(i)] = keys(place_y - (row - 1 + i));
  }
  Point sum = {0, 0, 0};
  if (column < 1 || row < 1 || column + 2 >= columns || row + 2 >= rows)
    return {0, 0, std::numeric_limits<Real>::quiet_NaN()};
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) {
      const Real weight = across[static_cast<std::size_t>(i)] * down[static_cast<std::size_t>(j)];
      const std::size_t at =
          6 + 3 * static_cast<std::size_t>((row - 1 + j) * columns + column - 1 + i);
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += weight * k[at + axis];
    }
  return sum;
}

PublishedRay ray_of_table(const Vector2d& pixel, const Parameters& k) {
  const Point ray = tabulated_ray(pixel.x(), pixel.y(), k);
  return {Vector3d::Zero(), Vector3d(static_cast<double>(ray[0]), static_cast<double>(ray[1]),
                                     static_cast<double>(ray[2]))
                                .normalized()};
}

/// By Newton's method from the middle: how far the table's ray passes the point's direction.
Plane tabulated(const Point& p, const Parameters& k) {
  constexpr int kSteps = 12;
  constexpr Real kStep = 1e-5L;
  const auto slopes = [&](Real u, Real v) -> Plane {
    const Point ray = tabulated_ray(u, v, k);
    return {ray[0] / ray[2] - p[0] / p[2], ray[1] / ray[2] - p[1] / p[2]};
  };
  Real u = k[2] + k[0] * (k[4] - 1) / 2, v = k[3] + k[1] * (k[5] - 1) / 2;
  for (int step = 0; step < kSteps; ++step) {
    const Plane here = slopes(u, v);
    const Plane right = slopes(u + kStep, v), left = slopes(u - kStep, v);
    const Plane below = slopes(u, v + kStep), above = slopes(u, v - kStep);
    const Real xu = (right[0] - left[0]) / (2 * kStep), yu = (right[1] - left[1]) / (2 * kStep);
    const Real xv = (below[0] - above[0]) / (2 * kStep), yv = (below[1] - above[1]) / (2 * kStep);
    const Real determinant = xu * yv - xv * yu;
    const Real du = (here[0] * yv - xv * here[1]) / determinant;
    const Real dv = (xu * here[1] - here[0] * yu) / determinant;
    u -= du;
    v -= dv;
    if (!std::isfinite(du)) break;
    if (std::abs(du) + std::abs(dv) < 1e-13L) return {u, v};
  }
  return {std::numeric_limits<Real>::quiet_NaN(), 0};
}

/// A barrel lens, told by the rays of nodes that go on beyond the image.
geo::CameraIntrinsics table_of_rays() {
  constexpr int kColumns = 21, kRows = 19;
  constexpr double kStep = 4.0, kFirst_x = -24.0, kFirst_y = -24.0, kFocal_px = 60.0;
  geo::CameraIntrinsics table{
      "tabulated", 32, 24, {kStep, kStep, kFirst_x, kFirst_y, double(kColumns), double(kRows)}};
  for (int j = 0; j < kRows; ++j)
    for (int i = 0; i < kColumns; ++i) {
      const double x = (kFirst_x + kStep * i - 16.0) / kFocal_px;
      const double y = (kFirst_y + kStep * j - 12.0) / kFocal_px;
      const double r = std::hypot(x, y), scale = r > 0.0 ? std::tan(0.9 * r) / r : 0.9;
      const Vector3d ray = Vector3d(scale * x, scale * y + 0.01 * x, 1.0).normalized();
      table.parameters.insert(table.parameters.end(), ray.begin(), ray.end());
    }
  return table;
}

const std::vector<PublishedCamera>& cameras() {
  constexpr double kTurn = 48 / (2 * std::numbers::pi);
  constexpr double kFar_m = 60.0, kNear_m = 22.0;
  static const std::vector<PublishedCamera> table = {
      {{"cylindrical", 48, 24, {kTurn, 8.0, 24, 12}}, cylindrical, 4.0, kNear_m, cylindrical_ray},
      {{"double_sphere", 32, 24, {20, 20, 16, 12, 0.3, 0.65}}, double_sphere, 1.9, kNear_m},
      {{"equirectangular", 48, 24, {kTurn, kTurn, 24, 12}},
       equirectangular,
       4.0,
       kNear_m,
       equirectangular_ray},
      {{"extended_unified", 32, 24, {20, 20.4, 16, 12, 0.6, 1.1}}, extended_unified, 1.7, kNear_m},
      {{"fov", 32, 24, {22, 22.5, 16, 12, 0.9}}, fov, 1.3, kFar_m},
      {{"full_opencv", 32, 24, {30, 31, 15.5, 12.2, 0.3, -0.1, 1e-3, -8e-4, 0.02, 0.6, 0.1, 0.01}},
       full_opencv,
       0.8,
       kFar_m},
      {{"opencv", 32, 24, {26, 27, 15.5, 12.2, -0.2, 0.05, 2e-3, -1e-3}}, opencv, 0.8, kFar_m},
      {{"opencv_fisheye", 32, 24, {12, 12.1, 16, 12, 0.01, -0.005, 0.001, -0.0002}},
       opencv_fisheye,
       2.2,
       kNear_m},
      {{"orthographic", 32, 24, {0.8, 0.85, 15.5, 12.2}},
       orthographic,
       4.0,
       kFar_m,
       orthographic_ray,
       false},
      {{"pinhole", 32, 24, {28, 28.5, 15.5, 12.2}}, pinhole, 1.4, kFar_m},
      {{"pushbroom", 32, 24, {28, 0.8, 15.5, 12.2}}, pushbroom, 4.0, kFar_m, pushbroom_ray, false},
      {{"radial", 32, 24, {26, 27, 15.5, 12.2, -0.1, 0.01}}, radial, 0.8, kFar_m},
      {{"simple_radial", 32, 24, {26, 26, 15.5, 12.2, -0.06}}, simple_radial, 0.8, kFar_m},
      {table_of_rays(), tabulated, 0.4, kFar_m, ray_of_table},
      {{"thin_prism_fisheye",
        32,
        24,
        {17, 17.2, 16, 12, 0.02, -0.01, 1e-3, -8e-4, 0.002, -0.0004, 1e-3, -2e-3}},
       thin_prism_fisheye,
       1.5,
       kNear_m},
      {{"unified", 32, 24, {46, 47, 15.5, 12.2, 0.9, -0.2, 0.05, 1e-3, -8e-4}},
       unified,
       1.0,
       kFar_m}};
  return table;
}

}  // namespace

const PublishedCamera* PublishedCamera::find(std::string_view model) {
  for (const PublishedCamera& camera : cameras())
    if (camera.intrinsics().model == model) return &camera;
  return nullptr;
}

std::optional<Vector2d> PublishedCamera::project(const Vector3d& point_camera) const {
  if (!is_central()) {
    if (!(point_camera.z() > 0.0)) return std::nullopt;
  } else if (std::acos(std::clamp(point_camera.z() / point_camera.norm(), -1.0, 1.0)) >
             widest_rad_) {
    return std::nullopt;
  }
  const Plane place =
      projection_({point_camera.x(), point_camera.y(), point_camera.z()}, intrinsics_.parameters);
  const Vector2d pixel(static_cast<double>(place[0]), static_cast<double>(place[1]));
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<PublishedRay> PublishedCamera::ray(const Vector2d& pixel) const {
  if (rays_ != nullptr) return rays_(pixel, intrinsics_.parameters);
  // From many directions, since some lenses see far round; by steps on the sphere.
  constexpr int kStarts = 400;
  constexpr int kSteps = 60;
  constexpr double kStep = 1e-6;
  Vector3d ray = Vector3d::UnitZ();
  double nearest_px = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kStarts; ++i) {
    const double z = 1.0 - 2.0 * (i + 0.5) / kStarts, r = std::sqrt(1.0 - z * z);
    const double turn = std::numbers::pi * (3.0 - std::sqrt(5.0)) * i;
    const Vector3d start(r * std::cos(turn), r * std::sin(turn), z);
    const std::optional<Vector2d> there = project(start);
    if (!there || (*there - pixel).norm() >= nearest_px) continue;
    nearest_px = (*there - pixel).norm();
    ray = start;
  }
  for (int step = 0; step < kSteps; ++step) {
    const std::optional<Vector2d> here = project(ray);
    if (!here) return std::nullopt;
    const Vector2d miss = pixel - *here;
    if (miss.norm() < 1e-12 * (intrinsics_.width_px + intrinsics_.height_px))
      return PublishedRay{Vector3d::Zero(), ray};
    const Vector3d right = ray.unitOrthogonal(), below = ray.cross(right);
    Eigen::Matrix2d slopes;
    for (int axis = 0; axis < 2; ++axis) {
      const Vector3d aside = kStep * (axis == 0 ? right : below);
      const std::optional<Vector2d> after = project(ray + aside), before = project(ray - aside);
      if (!after || !before) return std::nullopt;
      slopes.col(axis) = (*after - *before) / (2.0 * kStep);
    }
    const Vector2d turn = slopes.inverse() * miss;
    // Shortened until it comes nearer: where columns meet in a pole, slopes change fast.
    for (double share = 1.0; share > 1e-9; share *= 0.5) {
      const Vector3d next = (ray + share * (turn.x() * right + turn.y() * below)).normalized();
      const std::optional<Vector2d> there = project(next);
      if (!there || (pixel - *there).norm() >= miss.norm()) continue;
      ray = next;
      break;
    }
  }
  return std::nullopt;
}

}  // namespace terracast::test
