#include "validate/plane_lens.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace terracast::validate {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;

}  // namespace

PlaneLens::PlaneLens(const Coefficients& coefficients, double limit) : c_(coefficients) {
  const auto is_none = [](double value) { return value == 0.0; };
  is_radial_ = c_.p1 == 0.0 && c_.p2 == 0.0 && c_.sx == 0.0 && c_.sy == 0.0;
  is_plain_ = is_radial_ && std::all_of(c_.n.begin(), c_.n.end(), is_none) &&
              std::all_of(c_.d.begin(), c_.d.end(), is_none);
  radius_ = is_plain_ ? limit : find_radius(limit);
}

PlaneLens::Stretch PlaneLens::stretch(double r2) const {
  double over = 0.0, over_slope = 0.0, under = 0.0, under_slope = 0.0;
  for (int i = 3; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    over_slope = over_slope * r2 + (i + 1) * c_.n[k];
    over = (over + c_.n[k]) * r2;
  }
  for (int i = 2; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    under_slope = under_slope * r2 + (i + 1) * c_.d[k];
    under = (under + c_.d[k]) * r2;
  }
  over += 1.0;
  under += 1.0;
  if (!(under > 0.0)) return {kNone, kNone};
  return {over / under, (over_slope * under - over * under_slope) / (under * under)};
}

Vector2d PlaneLens::bent(const Vector2d& place) const {
  if (is_plain_) return place;
  const double x = place.x(), y = place.y(), r2 = place.squaredNorm(), s = stretch(r2).value;
  if (is_radial_) return s * place;
  return {x * s + (2.0 * c_.p1 * x * y + c_.p2 * (r2 + 2.0 * x * x)) + c_.sx * r2,
          y * s + (c_.p1 * (r2 + 2.0 * y * y) + 2.0 * c_.p2 * x * y) + c_.sy * r2};
}

Matrix2d PlaneLens::derivative(const Vector2d& place) const {
  if (is_plain_) return Matrix2d::Identity();
  const Stretch s = stretch(place.squaredNorm());
  Matrix2d d = s.value * Matrix2d::Identity() + 2.0 * s.slope * place * place.transpose();
  const double x = place.x(), y = place.y();
  d(0, 0) += 2.0 * c_.p1 * y + 6.0 * c_.p2 * x + 2.0 * c_.sx * x;
  d(0, 1) += 2.0 * c_.p1 * x + 2.0 * c_.p2 * y + 2.0 * c_.sx * y;
  d(1, 0) += 2.0 * c_.p1 * x + 2.0 * c_.p2 * y + 2.0 * c_.sy * x;
  d(1, 1) += 6.0 * c_.p1 * y + 2.0 * c_.p2 * x + 2.0 * c_.sy * y;
  return d;
}

double PlaneLens::least_growth(double radius) const {
  const int num_directions = is_radial_ ? 1 : 180;
  double least = kInfinity;
  for (int i = 0; i < num_directions; ++i) {
    const double angle = 2.0 * kPi * i / num_directions;
    const Matrix2d d = derivative({radius * std::cos(angle), radius * std::sin(angle)});
    const double trace = d(0, 0) + d(1, 1);
    const double across = 0.5 * (d(0, 1) + d(1, 0));
    const double growth = 0.5 * trace - std::hypot(0.5 * (d(0, 0) - d(1, 1)), across);
    if (std::isnan(growth)) return kNone;
    least = std::min(least, growth);
  }
  return least;
}

// Circles whose radii are tangents of even steps of an angle reach all of an endless plane.
double PlaneLens::find_radius(double limit) const {
  constexpr int kCircles = 2000;
  const double last = std::isinf(limit) ? 0.5 * kPi : std::atan(limit);
  double good = 0.0;
  for (int i = 1; i <= kCircles; ++i) {
    if (i == kCircles && std::isinf(limit)) return limit;
    double bad = i == kCircles ? limit : std::tan(last * i / kCircles);
    if (least_growth(bad) > 0.0) {
      good = bad;
      continue;
    }
    for (double middle = 0.5 * (good + bad); good < middle && middle < bad;
         middle = 0.5 * (good + bad))
      (least_growth(middle) > 0.0 ? good : bad) = middle;
    return good;
  }
  return limit;
}

// The lens grows along every straight way within its disc. So the way from a place to the target's, by Newton, is
// halved until it comes nearer and stays inside.
Vector2d PlaneLens::straight(const Vector2d& target) const {
  const Vector2d nowhere = Vector2d::Constant(kNone);
  if (!target.allFinite()) return nowhere;
  if (is_plain_) return target.norm() < radius_ ? target : nowhere;
  constexpr int kMostSteps = 100;
  constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();
  const double start = target.norm() < 0.9 * radius_ ? 1.0 : 0.9 * radius_ / target.norm();
  Vector2d at = start * target;
  Vector2d miss = bent(at) - target;
  // A fold of targets that lie far outside may be nearer at the middle.
  if (!(miss.norm() < target.norm())) {
    at.setZero();
    miss = -target;
  }
  for (int i = 0; i < kMostSteps && miss.norm() > kRounding * target.norm(); ++i) {
    const Vector2d step = derivative(at).partialPivLu().solve(miss);
    double share = 1.0;
    for (; share > 1e-9; share *= 0.5) {
      const Vector2d next = at - share * step;
      if (!(next.norm() < radius_)) continue;
      const Vector2d next_miss = bent(next) - target;
      if (!(next_miss.norm() < miss.norm())) continue;
      at = next;
      miss = next_miss;
      break;
    }
    if (!(share > 1e-9)) break;
  }
  constexpr double kMost = 1e-13;
  return miss.norm() <= kMost * (1.0 + target.norm()) ? at : nowhere;
}

}  // namespace terracast::validate
