#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

/// The motion of a rigid body without moments, by Jacobi's elliptic functions.
namespace terracast::test {

struct Elliptic {
  double sn, cn, dn;
};
/// Jacobi's functions by the arithmetic-geometric mean (Abramowitz and Stegun, 16.4).
inline Elliptic jacobi(double u, double k) {
  double a[12] = {1.0}, c[12] = {k};
  double b = std::sqrt(1.0 - k * k);
  int n = 0;
  for (; c[n] > 1e-17 && n < 11; ++n) {
    a[n + 1] = 0.5 * (a[n] + b);
    c[n + 1] = 0.5 * (a[n] - b);
    b = std::sqrt(a[n] * b);
  }
  double phi = std::ldexp(a[n] * u, n);
  for (; n > 0; --n) phi = 0.5 * (phi + std::asin(c[n] / a[n] * std::sin(phi)));
  const double sn = std::sin(phi);
  return {sn, std::cos(phi), std::sqrt(1.0 - k * k * sn * sn)};
}

/// A free body that turns about its axis of the largest moment of inertia, J.x < J.y < J.z.
class FreeTumbling {
 public:
  FreeTumbling(const Eigen::Vector3d& inertia, const Eigen::Vector3d& turn_rate) : j_(inertia) {
    const double energy2 = inertia.dot(turn_rate.cwiseAbs2());
    const double square = inertia.cwiseProduct(turn_rate).squaredNorm();
    momentum_ = std::sqrt(square);
    const double x = j_.x(), y = j_.y(), z = j_.z();
    const double less = energy2 * z - square, more = square - energy2 * x;
    EXPECT_GT(square, energy2 * y);
    size_ = {std::sqrt(less / (x * (z - x))), std::sqrt(less / (y * (z - y))),
             std::sqrt(more / (z * (z - x)))};
    rate_ = std::sqrt((z - y) * more / (x * y * z));
    k_ = std::sqrt((y - x) * less / ((z - y) * more));
    start_ = std::ellint_1(k_, std::asin(turn_rate.y() / size_.y()));
  }
  Eigen::Vector3d turn_rate(double time_s) const {
    const Elliptic e = jacobi(start_ + rate_ * time_s, k_);
    return {size_.x() * e.cn, size_.y() * e.sn, size_.z() * e.dn};
  }
  /// Attitude against axes of which z is along the momentum: by its nutation and spin, which follow from the turn rate, and
  /// the precession, whose rate is integrated (Simpson).
  Eigen::Quaterniond attitude(double time_s) const {
    constexpr int kParts = 3000;
    const auto precession = [&](double t) {
      const Eigen::Vector3d w = turn_rate(t);
      const Eigen::Vector3d l = j_.cwiseProduct(w);
      return momentum_ * (j_.x() * w.x() * w.x() + j_.y() * w.y() * w.y()) /
             l.head<2>().squaredNorm();
    };
    const double step = time_s / kParts;
    double angle = 0.0;
    for (int i = 0; i < kParts; ++i)
      angle +=
          step / 6.0 *
          (precession(i * step) + 4.0 * precession((i + 0.5) * step) + precession((i + 1) * step));
    const Eigen::Vector3d l = j_.cwiseProduct(turn_rate(time_s)) / momentum_;
    return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) *
           Eigen::AngleAxisd(std::acos(l.z()), Eigen::Vector3d::UnitX()) *
           Eigen::AngleAxisd(std::atan2(l.x(), l.y()), Eigen::Vector3d::UnitZ());
  }

 private:
  Eigen::Vector3d j_, size_;
  double momentum_, rate_, k_, start_;
};

}  // namespace terracast::test
