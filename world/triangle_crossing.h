#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>

namespace terracast::world {

/// A ray made ready for triangles: its direction's largest component becomes the third axis, along
/// which the others are sheared away, so that it meets a triangle where the triangle's shadow on the
/// plane of the first two axes holds the origin (Woop, Benthin and Wald, 2013).
struct ShearedRay {
  std::array<int, 3> axes;
  std::array<double, 3> origin;  ///< along these axes
  double shear_x, shear_y;       ///< of the other two per the third
  double inverse_z;

  /// direction   not zero
  ShearedRay(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction);
};

using TriangleCorners = std::array<Eigen::Vector3i, 3>;  ///< in steps of kHeightStep_m

/// Up to four triangles, field by field. Corners in steps of kHeightStep_m.
struct TriangleBlock {
  static constexpr int kTriangles = 4;
  std::int32_t steps[3][3][kTriangles];  ///< axis, corner
  std::uint32_t number[kTriangles];      ///< of each triangle, for who made the block
  std::uint32_t count;

  void set(int lane, const TriangleCorners& corners, std::uint32_t triangle_number);
};

/// A difference of two products errs by less than this share of them: three roundings of 2^-53.
inline constexpr double kProductsDoubt = 0x1.0p-51;

/// a b - c d of products that are not rounded. Its sign is that of the true value, or it is 0; with a,
/// b and c, d exchanged it is the negative of what it was.
inline double difference_of_products(double a, double b, double c, double d) {
  const double p = a * b;
  const double q = c * d;
  return (p - q) + (std::fma(a, b, -p) - std::fma(c, d, -q));
}

/// Where a ray crosses a triangle's plane, and how much each corner counts there.
struct TriangleCrossing {
  double t = 0.0;
  std::array<double, 3> weights = {};  ///< none negative; their sum is 1
};

/// The one definition of whether and where a ray crosses a triangle, in double.
///
/// With the corners a, b, c seen from the ray's origin (each coordinate rounded once), sheared, each
/// has a place (x, y) and a t = z / direction's z. The ray crosses the triangle when
///
///     u = xc yb - yc xb,   v = xa yc - ya xc,   w = xb ya - yb xa
///
/// have no two opposite signs and a sum that is not 0, at t = (u ta + v tb + w tc) / (u + v + w), from
/// both sides. Where rounding could show in a sign, u, v and w are computed again with exact products.
/// A corner's place is the same in all triangles that share it, and an edge's sign in one triangle is
/// the opposite of that in the other: so no ray passes between triangles that share an edge, nor
/// through a corner of a closed mesh. t lies between those of the corners, grazing rays' too.
///
/// accuracy   t: 2^-50 of the largest coordinate over the ray's rate of closing in on the plane
struct BlockCrossings {
  double t[TriangleBlock::kTriangles];
  std::uint32_t crossed;  ///< a bit each
};
void cross_block(const ShearedRay& ray, const TriangleBlock& block, BlockCrossings& crossings);

/// The same of one triangle, for its weights: exact products throughout.
/// returns   false: the ray does not cross it
bool cross_triangle(const ShearedRay& ray, const TriangleCorners& corners,
                    TriangleCrossing& crossing);

}  // namespace terracast::world
