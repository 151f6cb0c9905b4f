#include "geo/cameras/plane_distortion.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace terracast::geo {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

}  // namespace

PlaneDistortion::PlaneDistortion(const Coefficients& coefficients, double limit)
    : c_(coefficients) {
  const auto is_zero = [](const auto& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return value == 0.0; });
  };
  is_radial_ = is_zero(c_.p) && is_zero(c_.prism);
  is_identity_ = is_radial_ && is_zero(c_.k) && is_zero(c_.d);
  radius_ = is_identity_ ? limit : find_radius(limit);
}

PlaneDistortion::Scale PlaneDistortion::scale(double r2) const {
  const auto& [k1, k2, k3, k4] = c_.k;
  const auto& [d1, d2, d3] = c_.d;
  const double above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)));
  const double above_slope = k1 + r2 * (2.0 * k2 + r2 * (3.0 * k3 + r2 * 4.0 * k4));
  const double below = 1.0 + r2 * (d1 + r2 * (d2 + r2 * d3));
  const double below_slope = d1 + r2 * (2.0 * d2 + r2 * 3.0 * d3);
  const double value = above / below;
  return {below > 0.0 ? value : kNone, (above_slope - value * below_slope) / below};
}

Eigen::Vector2d PlaneDistortion::distorted(const Eigen::Vector2d& point) const {
  if (is_identity_) return point;
  const double x = point.x(), y = point.y();
  const double r2 = x * x + y * y;
  const double s = scale(r2).value;
  if (is_radial_) return s * point;
  return {s * x + 2.0 * c_.p[0] * x * y + c_.p[1] * (r2 + 2.0 * x * x) + c_.prism[0] * r2,
          s * y + c_.p[0] * (r2 + 2.0 * y * y) + 2.0 * c_.p[1] * x * y + c_.prism[1] * r2};
}

Eigen::Matrix2d PlaneDistortion::jacobian(const Eigen::Vector2d& point) const {
  if (is_identity_) return Eigen::Matrix2d::Identity();
  const double x = point.x(), y = point.y();
  const Scale s = scale(x * x + y * y);
  const double both = 2.0 * (s.slope * x * y + c_.p[0] * x + c_.p[1] * y);
  Eigen::Matrix2d jacobian;
  jacobian << s.value + 2.0 * (s.slope * x * x + c_.p[0] * y + 3.0 * c_.p[1] * x + c_.prism[0] * x),
      both + 2.0 * c_.prism[0] * y,  //
      both + 2.0 * c_.prism[1] * x,
      s.value + 2.0 * (s.slope * y * y + 3.0 * c_.p[0] * y + c_.p[1] * x + c_.prism[1] * y);
  return jacobian;
}

double PlaneDistortion::radial_slope(double r) const {
  const Scale s = scale(r * r);
  return s.value + 2.0 * r * r * s.slope;
}

/// The least that the symmetric part of the Jacobian stretches at a distance from the origin.
double PlaneDistortion::least_stretch(double r) const {
  if (is_radial_) return std::min(scale(r * r).value, radial_slope(r));
  constexpr int kDirections = 64;
  double least = kInfinity;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kDirections;
    const Eigen::Matrix2d j = jacobian({r * std::cos(angle), r * std::sin(angle)});
    const double middle = 0.5 * (j(0, 0) + j(1, 1));
    const double half_difference = 0.5 * (j(0, 0) - j(1, 1));
    const double aside = 0.5 * (j(0, 1) + j(1, 0));
    const double stretch = middle - std::hypot(half_difference, aside);
    if (std::isnan(stretch)) return kNone;
    least = std::min(least, stretch);
  }
  return least;
}

// Radii in steps of an angle, so that all of an infinite plane is looked at.
double PlaneDistortion::find_radius(double limit) const {
  constexpr int kSteps = 1024;
  const double last_angle = std::isinf(limit) ? 0.5 * std::numbers::pi : std::atan(limit);
  double inside = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    const bool is_last = i == kSteps;
    if (is_last && std::isinf(limit)) return kInfinity;
    double outside = is_last ? limit : std::tan(last_angle * i / kSteps);
    if (least_stretch(outside) > 0.0) {
      inside = outside;
      continue;
    }
    while (true) {
      const double middle = 0.5 * (inside + outside);
      if (middle <= inside || middle >= outside) return inside;
      (least_stretch(middle) > 0.0 ? inside : outside) = middle;
    }
  }
  return limit;
}

/// Of r s(r^2) = target, by Newton's method between bounds that close in on it.
double PlaneDistortion::undistorted_radius(double target) const {
  const auto excess = [&](double r) { return r * scale(r * r).value - target; };
  double low = 0.0;
  double high = radius_;
  if (std::isinf(high)) {
    constexpr double kFarthest = 1e12;
    for (high = std::max(target, 1.0); !(excess(high) >= 0.0); high *= 2.0)
      if (high > kFarthest) return kNone;
  } else if (!(excess(high) > 0.0)) {
    return kNone;
  }
  double r = std::min(target, 0.5 * (low + high));
  constexpr int kMostSteps = 200;
  for (int i = 0; i < kMostSteps; ++i) {
    const double over = excess(r);
    if (over == 0.0) return r;
    (over > 0.0 ? high : low) = r;
    double next = r - over / radial_slope(r);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= kEpsilon * r) return next;
    r = next;
  }
  return r;
}

Eigen::Vector2d PlaneDistortion::undistorted(const Eigen::Vector2d& place) const {
  const Eigen::Vector2d none = Eigen::Vector2d::Constant(kNone);
  if (!place.allFinite()) return none;
  if (is_identity_) return holds(place) ? place : none;
  const double target = place.norm();
  if (target == 0.0) return place;
  const double radius = undistorted_radius(target);
  if (is_radial_) return (radius / target) * place;

  // The stretch of the map is positive: of steps that stay in the disc, short enough ones come nearer.
  // Such steps end where the map is one to one, or at the disc's border, when no point of it comes there.
  Eigen::Vector2d point =
      (std::isnan(radius) ? 0.999 * std::min(radius_, 1e3) : radius) / target * place;
  Eigen::Vector2d miss = distorted(point) - place;
  constexpr int kMostSteps = 100;
  for (int i = 0; i < kMostSteps; ++i) {
    const Eigen::Vector2d step = -jacobian(point).inverse() * miss;
    double share = 1.0;
    constexpr double kLeastShare = 1e-12;
    for (; share > kLeastShare; share *= 0.5) {
      const Eigen::Vector2d next = point + share * step;
      if (!holds(next)) continue;
      const Eigen::Vector2d next_miss = distorted(next) - place;
      if (!(next_miss.squaredNorm() < miss.squaredNorm())) continue;
      point = next;
      miss = next_miss;
      break;
    }
    if (!(share > kLeastShare) || miss.isZero(0.0)) break;
  }
  constexpr double kRoundings = 64.0;
  return miss.norm() <= kRoundings * kEpsilon * std::max(target, point.norm()) ? point : none;
}

}  // namespace terracast::geo
