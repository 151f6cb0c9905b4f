#pragma once

#include <Eigen/Core>
#include <array>

namespace terracast::geo {

/// How a lens moves points of its plane of projection: radially, by decentring and by thin prisms.
///
///     (x', y') = s (x, y) + (2 p1 x y + p2 (r2 + 2 x^2), p1 (r2 + 2 y^2) + 2 p2 x y) + (s1, s2) r2
///     s = (1 + k1 r2 + k2 r2^2 + k3 r2^3 + k4 r2^4) / (1 + d1 r2 + d2 r2^2 + d3 r2^3),  r2 = x^2 + y^2
///
/// Domain: the largest disc about the origin in which the symmetric part of the Jacobian is positive
/// definite. On a convex domain such a map is one to one; without decentring and prisms it is where r'
/// grows with r. Beyond it the polynomials fold the image back on itself.
///
/// source     D. C. Brown, Decentering distortion of lenses, Photogrammetric Engineering 32 (1966);
///            J. Weng, P. Cohen, M. Herniou, Camera calibration with distortion models and accuracy
///            evaluation, PAMI 14 (1992); the domain: D. Gale, H. Nikaido, The Jacobian matrix and
///            global univalence of mappings, Math. Annalen 159 (1965)
/// threads    safe
class PlaneDistortion {
 public:
  struct Coefficients {
    std::array<double, 4> k{};      ///< of the radial numerator
    std::array<double, 3> d{};      ///< of the radial denominator
    std::array<double, 2> p{};      ///< decentring
    std::array<double, 2> prism{};  ///< thin prisms
  };

  /// limit   no point lies farther from the origin; may be infinite
  PlaneDistortion(const Coefficients& coefficients, double limit);
  /// Points stay where they are.
  explicit PlaneDistortion(double limit) : PlaneDistortion(Coefficients{}, limit) {}

  /// Radius of the domain, which it does not hold itself; may be infinite.
  double radius() const { return radius_; }
  bool holds(const Eigen::Vector2d& point) const { return point.squaredNorm() < radius_ * radius_; }

  Eigen::Vector2d distorted(const Eigen::Vector2d& point) const;
  Eigen::Matrix2d jacobian(const Eigen::Vector2d& point) const;

  /// The point of the domain that comes to lie there; NaN when there is none.
  /// accuracy   a few roundings of `place`: what is found and comes to lie farther off counts as none
  Eigen::Vector2d undistorted(const Eigen::Vector2d& place) const;

 private:
  struct Scale {
    double value;
    double slope;  ///< by r2
  };
  Scale scale(double r2) const;
  double radial_slope(double r) const;
  double least_stretch(double r) const;
  double find_radius(double limit) const;
  double undistorted_radius(double target) const;

  Coefficients c_;
  bool is_radial_;
  bool is_identity_;
  double radius_;
};

}  // namespace terracast::geo
