#pragma once

#include <gmpxx.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>

#include "validate/oracle/box_tree.h"
#include "validate/oracle/exact_objects.h"
#include "validate/oracle/exact_world.h"

/// Where a ray crosses a triangle of the ground or of an object, and which of several it crosses first: by bounds in
/// double and exact predicates, and by rational arithmetic where those cannot tell.
namespace terracast::oracle {

/// By which boxes are larger: a thousand times what the rounding of a parameter moves a point by at
/// 1000 km.
inline constexpr double kMargin_m = 1e-6;

/// A triangle of a tile: its cell, and which half of it.
struct Facet {
  std::uint32_t leaf = 0;
  int i = 0;
  int j = 0;
  bool is_upper = false;
  std::array<Eigen::Vector3d, 3> corners;

  auto order() const { return std::tuple(leaf, j, i, is_upper); }
};

/// Samples of a cell's triangle: at the right angle, then beside it along x, then along y.
std::array<std::array<int, 2>, 3> corners_of(int i, int j, bool is_upper);

/// The point at a parameter, each coordinate within 1 ulp of the exact one.
Eigen::Vector3d exact_point(const ExactRay& ray, const mpq_class& t);

/// The parameter at which a ray crosses the plane of a facet that it meets, between bounds in double
/// and, once asked for, exact.
class Crossing {
 public:
  Crossing(const ExactRay& ray, const Facet& facet);

  /// Whether the ray lies in the facet's plane.
  bool is_within_plane() const;
  const Facet& facet() const { return facet_; }
  /// Upward, its z the spacing.
  const Eigen::Vector3d& normal() const { return normal_; }
  double high() const { return high_; }
  mpq_class exact() const;
  /// At once: the first by tile and cell.
  bool is_before(const Crossing& other) const;

 private:
  const ExactRay* ray_;
  Facet facet_;
  Eigen::Vector3d normal_;
  double low_ = -std::numeric_limits<double>::infinity();
  double high_ = std::numeric_limits<double>::infinity();
};

/// The first of the objects' triangles that a ray meets, by exact predicates and rational arithmetic.
class NearestObject {
 public:
  explicit NearestObject(const ExactRay& ray) : ray_(ray) {}

  /// within   the box of a tile: what lies beyond its sides counts in the tile beside, where the same
  ///          object stands
  void meet(const ObjectFacet& facet, const Box& within);

  /// No less than the parameter; +inf: none was met.
  double high() const;
  /// Before the ground; the ground where both are met at once.
  bool is_before(const std::optional<Crossing>& ground) const {
    return facet_ && (!ground || t_ < ground->exact());
  }
  /// Of what was met; nothing beyond t_max.
  std::optional<ExactHit> hit(double t_max) const;

 private:
  const ExactRay& ray_;
  std::optional<ObjectFacet> facet_;
  mpq_class t_;
};

}  // namespace terracast::oracle
