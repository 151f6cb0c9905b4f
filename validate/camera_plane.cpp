#include "validate/camera_plane.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "core/error.h"
#include "validate/plane_lens.h"
#include "validate/ray_table.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Numbers = std::vector<double>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = 3.14159265358979323846;
const Vector3d kNoRay = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

/// Brought to unit length; no ray where doubles hold no such length.
Vector3d unit_ray(const Vector3d& along) {
  constexpr double kNear = 1e-9;
  const Vector3d ray = along / along.norm();
  return std::abs(ray.norm() - 1.0) < kNear ? ray : kNoRay;
}

/// Rays start no farther from their camera than the Earth is wide: beyond, none comes in.
constexpr double kFarthestOrigin_m = 2e7;
bool is_near(const Vector2d& place) { return place.cwiseAbs().maxCoeff() < kFarthestOrigin_m; }

/// Planes before the camera, x / z and y / z, and a lens: pinhole to full_opencv.
class PerspectivePlane final : public CameraPlane {
 public:
  PerspectivePlane(const std::string& model, const Numbers& p, const PlaneLens::Coefficients& lens)
      : CameraPlane(model, p), lens_(lens, kInfinity) {}

  std::optional<Vector2d> place_from_point(const Vector3d& point) const override {
    if (!(point.z() > 0.0)) return std::nullopt;
    const Vector2d straight(point.x() / point.z(), point.y() / point.z());
    if (!(straight.norm() < lens_.radius())) return std::nullopt;
    return lens_.bent(straight);
  }
  Vector3d ray_from_place(const Vector2d& place) const override {
    const Vector2d straight = lens_.straight(place);
    return unit_ray({straight.x(), straight.y(), 1.0});
  }

 private:
  PlaneLens lens_;
};

/// Angles from the axis, and a lens: Kannala and Brandt.
class FisheyePlane final : public CameraPlane {
 public:
  FisheyePlane(const std::string& model, const Numbers& p, const PlaneLens::Coefficients& lens)
      : CameraPlane(model, p), lens_(lens, kPi) {}

  std::optional<Vector2d> place_from_point(const Vector3d& point) const override {
    const double aside = std::hypot(point.x(), point.y());
    const double angle = std::atan2(aside, point.z());
    if (!(angle < lens_.radius())) return std::nullopt;
    if (aside == 0.0) return Vector2d(0.0, 0.0);
    return lens_.bent({angle * (point.x() / aside), angle * (point.y() / aside)});
  }
  Vector3d ray_from_place(const Vector2d& place) const override {
    const Vector2d straight = lens_.straight(place);
    const double angle = straight.norm();
    if (angle == 0.0) return Vector3d::UnitZ();
    const double aside = std::sin(angle) / angle;
    return unit_ray({aside * straight.x(), aside * straight.y(), std::cos(angle)});
  }

 private:
  PlaneLens lens_;
};

/// Devernay and Faugeras: r = atan(2 (r / z) tan(w / 2)) / w.
class FovPlane final : public CameraPlane {
 public:
  explicit FovPlane(const Numbers& p)
      : CameraPlane("fov", p), omega_(p[0]), steep_(2.0 * std::tan(0.5 * p[0])) {}

  std::optional<Vector2d> place_from_point(const Vector3d& point) const override {
    if (!(point.z() > 0.0)) return std::nullopt;
    const Vector2d straight(point.x() / point.z(), point.y() / point.z());
    const double r = straight.norm();
    return Vector2d(straight * (r == 0.0 ? steep_ / omega_ : std::atan(r * steep_) / (omega_ * r)));
  }
  Vector3d ray_from_place(const Vector2d& place) const override {
    const double r = place.norm();
    if (r == 0.0) return Vector3d::UnitZ();
    if (!(r * omega_ < 0.5 * kPi)) return kNoRay;
    // tan may be large near the rim: sine and cosine instead of it.
    const Vector2d along = place / r * std::sin(r * omega_);
    return unit_ray({along.x(), along.y(), steep_ * std::cos(r * omega_)});
  }

 private:
  double omega_, steep_;
};

/// Mei and Rives: the unit sphere seen from xi behind its centre, and a lens.
class UnifiedPlane final : public CameraPlane {
 public:
  explicit UnifiedPlane(const Numbers& p)
      : CameraPlane("unified", p),
        xi_(p[0]),
        lens_({.n = {p[1], p[2], 0.0, 0.0}, .d = {}, .p1 = p[3], .p2 = p[4], .sx = 0.0, .sy = 0.0},
              p[0] > 1.0 ? 1.0 / std::sqrt(p[0] * p[0] - 1.0) : kInfinity) {}

  std::optional<Vector2d> place_from_point(const Vector3d& point) const override {
    const Vector3d on_sphere = point.normalized();
    if (!(on_sphere.z() > -std::min(xi_, 1.0 / xi_))) return std::nullopt;
    const Vector2d straight = on_sphere.head<2>() / (on_sphere.z() + xi_);
    if (!(straight.norm() < lens_.radius())) return std::nullopt;
    return lens_.bent(straight);
  }
  // The line from (0, 0, -xi) through (x, y, 1 - xi) meets the sphere: |l (x, y, 1) - (0, 0, xi)| = 1, the larger l.
  Vector3d ray_from_place(const Vector2d& place) const override {
    const Vector2d straight = lens_.straight(place);
    const double squared = straight.squaredNorm() + 1.0;
    const double under = 1.0 - (xi_ * xi_ - 1.0) * (squared - 1.0);
    if (!(under >= 0.0)) return kNoRay;
    const double l = (xi_ + std::sqrt(under)) / squared;
    return unit_ray({l * straight.x(), l * straight.y(), l - xi_});
  }

 private:
  double xi_;
  PlaneLens lens_;
};

/// Khomutenko: (x, y) / (alpha d + (1 - alpha) z), d² = beta (x² + y²) + z².
class ExtendedUnifiedPlane final : public CameraPlane {
 public:
  explicit ExtendedUnifiedPlane(const Numbers& p)
      : CameraPlane("extended_unified", p), alpha_(p[0]), beta_(p[1]) {}

  std::optional<Vector2d> place_from_point(const Vector3d& point) const override {
    const double d = std::sqrt(beta_ * point.head<2>().squaredNorm() + point.z() * point.z());
    const double back = std::min(alpha_, 1.0 - alpha_) / std::max(alpha_, 1.0 - alpha_);
    if (!(point.z() > -back * d)) return std::nullopt;
    return Vector2d(point.head<2>() / (alpha_ * d + (1.0 - alpha_) * point.z()));
  }
  // With m the place and z the ray's third number for a denominator of 1: alpha sqrt(beta m² + z²) = 1 - (1 - alpha) z.
  Vector3d ray_from_place(const Vector2d& place) const override {
    const double m2 = place.squaredNorm();
    const double under = 1.0 - (2.0 * alpha_ - 1.0) * beta_ * m2;
    if (!(under > 0.0)) return kNoRay;
    const double z =
        (1.0 - alpha_ * alpha_ * beta_ * m2) / (alpha_ * std::sqrt(under) + (1.0 - alpha_));
    const Vector3d ray = unit_ray({place.x(), place.y(), z});
    return place_from_point(ray) ? ray : kNoRay;
  }

 private:
  double alpha_, beta_;
};

/// Usenko: two spheres, xi apart, then a plane shifted by alpha / (1 - alpha).
class DoubleSpherePlane final : public CameraPlane {
 public:
  explicit DoubleSpherePlane(const Numbers& p)
      : CameraPlane("double_sphere", p), xi_(p[0]), alpha_(p[1]) {}

  std::optional<Vector2d> place_from_point(const Vector3d& point) const override {
    const Vector3d first = point.normalized();
    const Vector3d moved = first + Vector3d(0.0, 0.0, xi_);
    const double d = moved.norm();
    const double back = std::min(alpha_, 1.0 - alpha_) / std::max(alpha_, 1.0 - alpha_);
    if (!(moved.z() > -back * d) || !(xi_ * first.z() > -1.0)) return std::nullopt;
    return Vector2d(first.head<2>() / (alpha_ * d + (1.0 - alpha_) * moved.z()));
  }
  // Back through the plane to the second sphere, as extended_unified with beta 1, then along that ray, w, from
  // (0, 0, -xi) to the first: |k w - (0, 0, xi)| = 1.
  Vector3d ray_from_place(const Vector2d& place) const override {
    const double m2 = place.squaredNorm();
    const double under = 1.0 - (2.0 * alpha_ - 1.0) * m2;
    if (!(under >= 0.0)) return kNoRay;
    const double z = (1.0 - alpha_ * alpha_ * m2) / (alpha_ * std::sqrt(under) + (1.0 - alpha_));
    const Vector3d w = unit_ray({place.x(), place.y(), z});
    const double along = xi_ * w.z();
    const double inside = along * along - xi_ * xi_ + 1.0;
    if (!(inside >= 0.0)) return kNoRay;
    const Vector3d ray = (along + std::sqrt(inside)) * w - Vector3d(0.0, 0.0, xi_);
    return place_from_point(ray) ? unit_ray(ray) : kNoRay;
  }

 private:
  double xi_, alpha_;
};

/// Longitude, and latitude (downward) or the height on the cylinder of radius 1.
class PanoramaPlane final : public CameraPlane {
 public:
  PanoramaPlane(const std::string& model, const Numbers& p, bool is_cylinder)
      : CameraPlane(model, p), is_cylinder_(is_cylinder) {}

  std::optional<Vector2d> place_from_point(const Vector3d& point) const override {
    const double level = std::hypot(point.x(), point.z());
    if (!(level > 0.0)) return std::nullopt;
    return Vector2d(std::atan2(point.x(), point.z()),
                    is_cylinder_ ? point.y() / level : std::atan2(point.y(), level));
  }
  // Image edges that are the seam may pass it by a rounding.
  Vector3d ray_from_place(const Vector2d& place) const override {
    constexpr double kSeam = kPi * (1.0 + 1e-15);
    if (!(std::abs(place.x()) <= kSeam)) return kNoRay;
    const double sine = std::sin(place.x()), cosine = std::cos(place.x());
    if (is_cylinder_) return unit_ray({sine, place.y(), cosine});
    if (!(std::abs(place.y()) <= 0.5 * kPi * (1.0 + 1e-15))) return kNoRay;
    const double level = std::cos(place.y());
    return {level * sine, std::sin(place.y()), level * cosine};
  }
  double turn() const override { return 2.0 * kPi; }

 private:
  bool is_cylinder_;
};

/// Parallel rays along z.
class OrthographicPlane final : public CameraPlane {
 public:
  explicit OrthographicPlane(const Numbers& p) : CameraPlane("orthographic", p) {}

  std::optional<Vector2d> place_from_point(const Vector3d& point) const override {
    if (!(point.z() > 0.0)) return std::nullopt;
    return Vector2d(point.x(), point.y());
  }
  Vector3d ray_from_place(const Vector2d& place) const override {
    return is_near(place) ? Vector3d(Vector3d::UnitZ()) : kNoRay;
  }
  bool is_central() const override { return false; }
  Vector3d origin_from_place(const Vector2d& place) const override {
    return is_near(place) ? Vector3d(place.x(), place.y(), 0.0) : kNoRay;
  }
  double distance_m(const Vector3d& point) const override { return point.z(); }
  Vector3d distance_gradient(const Vector3d&) const override { return Vector3d::UnitZ(); }
};

/// Gupta and Hartley: a fan of rays in x and z that moves along y.
class PushbroomPlane final : public CameraPlane {
 public:
  explicit PushbroomPlane(const Numbers& p) : CameraPlane("pushbroom", p) {}

  std::optional<Vector2d> place_from_point(const Vector3d& point) const override {
    if (!(point.z() > 0.0)) return std::nullopt;
    return Vector2d(point.x() / point.z(), point.y());
  }
  Vector3d ray_from_place(const Vector2d& place) const override {
    return is_near({0.0, place.y()}) ? unit_ray({place.x(), 0.0, 1.0}) : kNoRay;
  }
  bool is_central() const override { return false; }
  Vector3d origin_from_place(const Vector2d& place) const override {
    return is_near({0.0, place.y()}) ? Vector3d(0.0, place.y(), 0.0) : kNoRay;
  }
  double distance_m(const Vector3d& point) const override {
    return std::hypot(point.x(), point.z());
  }
  Vector3d distance_gradient(const Vector3d& point) const override {
    return Vector3d(point.x(), 0.0, point.z()).normalized();
  }
};

using Plane = std::shared_ptr<const CameraPlane>;

Plane perspective(const char* model, const Numbers& p, const PlaneLens::Coefficients& lens) {
  return std::make_shared<PerspectivePlane>(model, p, lens);
}
Plane fisheye(const char* model, const Numbers& p, const PlaneLens::Coefficients& lens) {
  return std::make_shared<FisheyePlane>(model, p, lens);
}

/// A model by its name: how many parameters it has, and between what they lie.
struct Model {
  std::vector<std::array<double, 2>> ranges;
  std::function<Plane(const Numbers&)> make;
};

const std::map<std::string, Model>& models() {
  static const std::array<double, 2> kAny = {-kInfinity, kInfinity};
  static const auto any = [](std::size_t count) {
    return std::vector<std::array<double, 2>>(count, kAny);
  };
  static const std::map<std::string, Model> table = {
      {"pinhole", {any(0), [](const Numbers& p) { return perspective("pinhole", p, {}); }}},
      {"simple_radial",
       {any(1),
        [](const Numbers& p) {
          return perspective("simple_radial", p, {.n = {p[0], 0.0, 0.0, 0.0}});
        }}},
      {"radial",
       {any(2),
        [](const Numbers& p) {
          return perspective("radial", p, {.n = {p[0], p[1], 0.0, 0.0}});
        }}},
      {"opencv",
       {any(4),
        [](const Numbers& p) {
          return perspective("opencv", p,
                             {.n = {p[0], p[1], 0.0, 0.0}, .d = {}, .p1 = p[2], .p2 = p[3]});
        }}},
      {"full_opencv",
       {any(8),
        [](const Numbers& p) {
          return perspective(
              "full_opencv", p,
              {.n = {p[0], p[1], p[4], 0.0}, .d = {p[5], p[6], p[7]}, .p1 = p[2], .p2 = p[3]});
        }}},
      {"opencv_fisheye",
       {any(4),
        [](const Numbers& p) {
          return fisheye("opencv_fisheye", p, {.n = {p[0], p[1], p[2], p[3]}});
        }}},
      {"thin_prism_fisheye",
       {any(8),
        [](const Numbers& p) {
          return fisheye("thin_prism_fisheye", p,
                         {.n = {p[0], p[1], p[4], p[5]},
                          .d = {},
                          .p1 = p[2],
                          .p2 = p[3],
                          .sx = p[6],
                          .sy = p[7]});
        }}},
      {"fov", {{{1e-6, kPi}}, [](const Numbers& p) { return std::make_shared<FovPlane>(p); }}},
      {"unified",
       {{{0.0, 1e3}, kAny, kAny, kAny, kAny},
        [](const Numbers& p) { return std::make_shared<UnifiedPlane>(p); }}},
      {"extended_unified",
       {{{0.0, 1.0}, {1e-9, 1e9}},
        [](const Numbers& p) { return std::make_shared<ExtendedUnifiedPlane>(p); }}},
      {"double_sphere",
       {{{-1.0, 1e3}, {0.0, 1.0}},
        [](const Numbers& p) { return std::make_shared<DoubleSpherePlane>(p); }}},
      {"equirectangular",
       {any(0),
        [](const Numbers& p) {
          return std::make_shared<PanoramaPlane>("equirectangular", p, false);
        }}},
      {"cylindrical",
       {any(0),
        [](const Numbers& p) { return std::make_shared<PanoramaPlane>("cylindrical", p, true); }}},
      {"orthographic",
       {any(0), [](const Numbers& p) { return std::make_shared<OrthographicPlane>(p); }}},
      {"pushbroom", {any(0), [](const Numbers& p) { return std::make_shared<PushbroomPlane>(p); }}},
      {"tabulated",
       {{{4.0, 4096.0}, {4.0, 4096.0}},
        [](const Numbers& p) { return std::make_shared<RayTable>(p); }}},
  };
  return table;
}

}  // namespace

std::shared_ptr<const CameraPlane> make_camera_plane(const std::string& model,
                                                     const std::vector<double>& parameters) {
  const auto found = models().find(model);
  if (found == models().end())
    fail(ErrorKind::Input, "camera model \"{}\"; {} are known", model,
         fmt::join(camera_plane_models(), ", "));
  const auto& ranges = found->second.ranges;
  if (model == "tabulated" ? parameters.size() < ranges.size() : parameters.size() != ranges.size())
    fail(ErrorKind::Input, "camera model {}: {} parameters of its own, not {}", model,
         parameters.size(), ranges.size());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double value = parameters[i];
    if (!std::isfinite(value) ||
        (i < ranges.size() && !(value >= ranges[i][0] && value <= ranges[i][1])))
      fail(ErrorKind::Input, "camera model {}: parameter {} of its own is {}", model, i, value);
  }
  return found->second.make(parameters);
}

std::vector<std::string> camera_plane_models() {
  std::vector<std::string> names;
  for (const auto& [name, model] : models()) names.push_back(name);
  return names;
}

}  // namespace terracast::validate
