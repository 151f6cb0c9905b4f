#include "validate/oracle/exact_crossing.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Intersections_3/Ray_3_Triangle_3.h>

#include <Eigen/Geometry>
#include <cmath>

namespace terracast::oracle {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHalfUlp = 0x1.0p-53;

Kernel::Point_3 cgal(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

/// The upward normal of a facet, its z the spacing: exact, since heights lie on one lattice.
Eigen::Vector3d exact_normal(const Facet& facet) {
  const auto& [a, b, c] = facet.corners;
  const double spacing = std::abs(b.x() - a.x());
  const double to_b = b.z() - a.z();
  const double to_c = c.z() - a.z();
  return facet.is_upper ? Eigen::Vector3d(to_b, to_c, spacing)
                        : Eigen::Vector3d(-to_b, -to_c, spacing);
}

/// n   of doubles or of rational numbers
template <class Normal>
mpq_class exact_dot(const Normal& n, const Eigen::Vector3d& to, const Eigen::Vector3d& from) {
  mpq_class sum = 0;
  for (int k = 0; k < 3; ++k)
    sum += mpq_class(n[static_cast<std::size_t>(k)]) * (mpq_class(to[k]) - mpq_class(from[k]));
  return sum;
}

std::array<mpq_class, 3> exact_cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                     const Eigen::Vector3d& c) {
  std::array<mpq_class, 3> u;
  std::array<mpq_class, 3> v;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    u[i] = mpq_class(b[k]) - mpq_class(a[k]);
    v[i] = mpq_class(c[k]) - mpq_class(a[k]);
  }
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

}  // namespace

std::array<std::array<int, 2>, 3> corners_of(int i, int j, bool is_upper) {
  if (is_upper) return {{{i + 1, j + 1}, {i, j + 1}, {i + 1, j}}};
  return {{{i, j}, {i + 1, j}, {i, j + 1}}};
}

Eigen::Vector3d exact_point(const ExactRay& ray, const mpq_class& t) {
  Eigen::Vector3d point;
  for (int k = 0; k < 3; ++k) {
    const mpq_class origin(ray.origin_world[k]);
    point[k] = mpq_class(origin + t * (mpq_class(ray.through_world[k]) - origin)).get_d();
  }
  return point;
}

Crossing::Crossing(const ExactRay& ray, const Facet& facet)
    : ray_(&ray), facet_(facet), normal_(exact_normal(facet)) {
  const Eigen::Vector3d to_plane = facet.corners[0] - ray.origin_world;
  const Eigen::Vector3d along = ray.through_world - ray.origin_world;
  const double above = normal_.dot(to_plane);
  const double speed = normal_.dot(along);
  // Each product has two roundings (of the difference and its own), the two sums one more each;
  // twice that covers what is of second order.
  constexpr double kRoundings = 4.0 * 2.0 * kHalfUlp;
  const double above_error = kRoundings * normal_.cwiseAbs().dot(to_plane.cwiseAbs());
  const double speed_error = kRoundings * normal_.cwiseAbs().dot(along.cwiseAbs());
  const double least_speed = std::abs(speed) - speed_error;
  if (least_speed > 0.0) {
    const double t = above / speed;
    const double error =
        (above_error + std::abs(t) * speed_error) / least_speed + 2.0 * kHalfUlp * std::abs(t);
    // Half as much again covers the roundings of the error itself.
    low_ = t - 1.5 * error;
    high_ = t + 1.5 * error;
  }
}

bool Crossing::is_within_plane() const {
  return !std::isfinite(low_) && exact_dot(normal_, ray_->through_world, ray_->origin_world) == 0;
}

mpq_class Crossing::exact() const {
  return exact_dot(normal_, facet_.corners[0], ray_->origin_world) /
         exact_dot(normal_, ray_->through_world, ray_->origin_world);
}

bool Crossing::is_before(const Crossing& other) const {
  if (high_ < other.low_) return true;
  if (other.high_ < low_) return false;
  const int order = cmp(exact(), other.exact());
  return order != 0 ? order < 0 : facet_.order() < other.facet_.order();
}

void NearestObject::meet(const ObjectFacet& facet, const Box& within) {
  const auto& [a, b, c] = facet.corners_world;
  const Kernel::Ray_3 exact_ray(cgal(ray_.origin_world), cgal(ray_.through_world));
  const Kernel::Triangle_3 triangle(cgal(a), cgal(b), cgal(c));
  if (triangle.is_degenerate() || !CGAL::do_intersect(exact_ray, triangle)) return;
  const std::array<mpq_class, 3> normal = exact_cross(a, b, c);
  const mpq_class speed = exact_dot(normal, ray_.through_world, ray_.origin_world);
  if (speed == 0) return;  // along the triangle: its neighbours are met
  const mpq_class t = exact_dot(normal, a, ray_.origin_world) / speed;
  const Eigen::Vector3d at =
      ray_.origin_world + t.get_d() * (ray_.through_world - ray_.origin_world);
  for (int k = 0; k < 2; ++k)
    if (at[k] < within.lowest[k] - kMargin_m || at[k] > within.highest[k] + kMargin_m) return;
  const auto order = [](const ObjectFacet& f) { return std::tuple(f.instance_id, f.triangle); };
  if (facet_ && (t > t_ || (t == t_ && order(facet) >= order(*facet_)))) return;
  t_ = t;
  facet_ = facet;
}

double NearestObject::high() const {
  return facet_ ? std::nextafter(t_.get_d(), kInfinity) : kInfinity;
}

std::optional<ExactHit> NearestObject::hit(double t_max) const {
  if (t_max < kInfinity && t_ > mpq_class(t_max)) return std::nullopt;
  ExactHit hit;
  hit.t = t_.get_d();
  hit.point_world = exact_point(ray_, t_);
  const auto& [a, b, c] = facet_->corners_world;
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  const bool is_outward = normal.dot(ray_.through_world - ray_.origin_world) <= 0.0;
  hit.normal_world = is_outward ? normal : Eigen::Vector3d(-normal);
  hit.corners_world = facet_->corners_world;
  hit.object = ObjectHit{facet_->instance_id, facet_->semantic_class};
  return hit;
}

}  // namespace terracast::oracle
