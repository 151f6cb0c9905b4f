#pragma once

#include <Eigen/Core>
#include <array>

namespace terracast::validate {

/// The lens that moves places of a model's plane (docs/cameras.md, L), with derivatives in closed form:
///
///     L(x, y) = s (x, y) + (2 p1 x y + p2 (r² + 2 x²), p1 (r² + 2 y²) + 2 p2 x y) + (sx, sy) r²
///     s = (1 + n1 r² + n2 r⁴ + n3 r⁶ + n4 r⁸) / (1 + d1 r² + d2 r⁴ + d3 r⁶)
///
/// It holds in the largest disc in which the symmetric part of its derivative is positive definite, where it is one
/// to one, and at most up to a radius that the model gives.
class PlaneLens {
 public:
  struct Coefficients {
    std::array<double, 4> n{};
    std::array<double, 3> d{};
    double p1 = 0.0, p2 = 0.0, sx = 0.0, sy = 0.0;
  };
  /// limit   +inf: none
  PlaneLens(const Coefficients& coefficients, double limit);

  /// Of the disc.
  double radius() const { return radius_; }
  Eigen::Vector2d bent(const Eigen::Vector2d& place) const;
  Eigen::Matrix2d derivative(const Eigen::Vector2d& place) const;
  /// The place of the disc that comes to lie there; NaN where there is none.
  Eigen::Vector2d straight(const Eigen::Vector2d& target) const;

 private:
  /// s and d s / d r².
  struct Stretch {
    double value, slope;
  };
  Stretch stretch(double r2) const;
  /// The least eigenvalue of the derivative's symmetric part on a circle; NaN beyond a pole of s.
  double least_growth(double radius) const;
  double find_radius(double limit) const;

  Coefficients c_;
  bool is_plain_;   ///< leaves places where they are
  bool is_radial_;  ///< s alone
  double radius_;
};

}  // namespace terracast::validate
