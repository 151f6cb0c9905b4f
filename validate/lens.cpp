#include "validate/lens.h"

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <limits>

namespace terracast::validate {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

const Vector2d kNowhere = Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());

using Map = std::function<Vector2d(const Vector2d&)>;

/// Of FULL_OPENCV, and of THIN_PRISM_FISHEYE in the plane of angles.
Vector2d bent(const Lens& lens, const Vector2d& at) {
  const auto& [k1, k2, p1, p2, k3, k4, c6, c7] = lens.c;
  const double u = at.x(), v = at.y();
  const double uu = u * u, uv = u * v, vv = v * v, r2 = uu + vv, r4 = r2 * r2, r6 = r4 * r2;
  const double du = 2.0 * p1 * uv + p2 * (r2 + 2.0 * uu);
  const double dv = 2.0 * p2 * uv + p1 * (r2 + 2.0 * vv);
  if (lens.kind == Lens::Kind::Perspective) {
    const double radial = (1.0 + k1 * r2 + k2 * r4 + k3 * r6) / (1.0 + k4 * r2 + c6 * r4 + c7 * r6);
    return {u * radial + du, v * radial + dv};
  }
  const double radial = k1 * r2 + k2 * r4 + k3 * r6 + k4 * r4 * r4;
  return {u + u * radial + du + c6 * r2, v + v * radial + dv + c7 * r2};
}

Matrix2d differences(const Map& map, const Vector2d& at) {
  const double step = 1e-6 * std::max(1.0, at.norm());
  Matrix2d jacobian;
  for (int k = 0; k < 2; ++k)
    jacobian.col(k) =
        (map(at + step * Vector2d::Unit(k)) - map(at - step * Vector2d::Unit(k))) / (2.0 * step);
  return jacobian;
}

/// Of a map that turns nothing over between the origin and what is looked for: step by step on the straight way
/// of targets from the origin's, so that no fold is jumped.
Vector2d inverse(const Map& map, const Vector2d& target) {
  constexpr int kParts = 8;
  Vector2d at = Vector2d::Zero();
  for (int part = 1; part <= kParts; ++part) {
    const Vector2d goal = target * (static_cast<double>(part) / kParts);
    double miss = (map(at) - goal).norm();
    for (int i = 0; i < 50; ++i) {
      const Matrix2d jacobian = differences(map, at);
      if (!(jacobian.determinant() > 0.0)) return kNowhere;
      const Vector2d next = at - jacobian.inverse() * (map(at) - goal);
      const double next_miss = (map(next) - goal).norm();
      if (!(next_miss < miss)) break;
      at = next;
      miss = next_miss;
    }
    if (part == kParts && !(miss <= 1e-13 * (1.0 + target.norm()))) return kNowhere;
  }
  return differences(map, at).determinant() > 0.0 ? at : kNowhere;
}

}  // namespace

Vector2d Lens::distorted(const Vector2d& place) const {
  if (kind == Kind::None) return place;
  if (kind == Kind::Perspective) return bent(*this, place);
  const double r = place.norm();
  if (kind == Kind::Fov) {
    const double omega = c[0];
    if (r == 0.0) return place * (2.0 * std::tan(omega / 2.0) / omega);
    return place * (std::atan(2.0 * r * std::tan(omega / 2.0)) / (r * omega));
  }
  return bent(*this, r == 0.0 ? place : Vector2d(place * (std::atan(r) / r)));
}

Matrix2d Lens::jacobian(const Vector2d& place) const {
  if (kind == Kind::None) return Matrix2d::Identity();
  return differences([this](const Vector2d& at) { return distorted(at); }, place);
}

Vector2d Lens::undistorted(const Vector2d& target) const {
  if (kind == Kind::None) return target;
  const double radius = target.norm();
  if (radius == 0.0) return target;
  if (kind == Kind::Fov) {
    const double omega = c[0];
    if (!(radius * omega < std::acos(0.0))) return kNowhere;
    return target * (std::tan(radius * omega) / (2.0 * radius * std::tan(omega / 2.0)));
  }
  const Vector2d straight = inverse([this](const Vector2d& at) { return bent(*this, at); }, target);
  if (kind == Kind::Perspective) return straight;
  const double angle = straight.norm();
  if (!(angle < std::acos(0.0))) return kNowhere;
  return straight * (std::tan(angle) / angle);
}

std::optional<ColmapIntrinsics> colmap_intrinsics(const std::string& model,
                                                  const std::vector<double>& p) {
  using Kind = Lens::Kind;
  const auto is = [&](const char* name, std::size_t count) {
    return model == name && p.size() == count;
  };
  if (is("SIMPLE_PINHOLE", 3)) return ColmapIntrinsics{p[0], p[0], p[1], p[2], {}};
  if (is("PINHOLE", 4)) return ColmapIntrinsics{p[0], p[1], p[2], p[3], {}};
  if (is("SIMPLE_RADIAL", 4))
    return ColmapIntrinsics{p[0], p[0], p[1], p[2], {Kind::Perspective, {p[3]}}};
  if (is("RADIAL", 5))
    return ColmapIntrinsics{p[0], p[0], p[1], p[2], {Kind::Perspective, {p[3], p[4]}}};
  if (is("OPENCV", 8))
    return ColmapIntrinsics{p[0], p[1], p[2], p[3], {Kind::Perspective, {p[4], p[5], p[6], p[7]}}};
  if (is("FULL_OPENCV", 12))
    return ColmapIntrinsics{
        p[0],
        p[1],
        p[2],
        p[3],
        {Kind::Perspective, {p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11]}}};
  if (is("SIMPLE_RADIAL_FISHEYE", 4))
    return ColmapIntrinsics{p[0], p[0], p[1], p[2], {Kind::Fisheye, {p[3]}}};
  if (is("RADIAL_FISHEYE", 5))
    return ColmapIntrinsics{p[0], p[0], p[1], p[2], {Kind::Fisheye, {p[3], p[4]}}};
  if (is("OPENCV_FISHEYE", 8))
    return ColmapIntrinsics{
        p[0], p[1], p[2], p[3], {Kind::Fisheye, {p[4], p[5], 0.0, 0.0, p[6], p[7]}}};
  if (is("THIN_PRISM_FISHEYE", 12))
    return ColmapIntrinsics{p[0],
                            p[1],
                            p[2],
                            p[3],
                            {Kind::Fisheye, {p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11]}}};
  if (is("FOV", 5)) return ColmapIntrinsics{p[0], p[1], p[2], p[3], {Kind::Fov, {p[4]}}};
  return std::nullopt;
}

std::pair<std::string, std::vector<double>> colmap_model(const ColmapIntrinsics& camera) {
  const auto model = [&](const char* name, std::size_t num_of_lens) {
    std::vector<double> parameters{camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px};
    parameters.insert(parameters.end(), camera.lens.c.begin(),
                      camera.lens.c.begin() + static_cast<std::ptrdiff_t>(num_of_lens));
    return std::pair<std::string, std::vector<double>>(name, parameters);
  };
  switch (camera.lens.kind) {
    case Lens::Kind::Perspective:
      return model("FULL_OPENCV", 8);
    case Lens::Kind::Fisheye:
      return model("THIN_PRISM_FISHEYE", 8);
    case Lens::Kind::Fov:
      return model("FOV", 1);
    case Lens::Kind::None:
      break;
  }
  return model("PINHOLE", 0);
}

}  // namespace terracast::validate
