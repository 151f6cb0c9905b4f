#include "validate/oracle_sight.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <optional>

namespace terracast::validate {

namespace {

using oracle::ExactHit;

/// Points are rounded to double; COLMAP's were turned into another frame, which is good to 10 nm twice.
constexpr double kPointRounding_m = 5e-8;
/// Grazing rays would turn a point's rounding into kilometres.
constexpr double kMostAlong_m = 1e-4;

}  // namespace

bool Sight::is_tie() const {
  const bool is_seen_here = is_seen();
  const Eigen::Vector3d along = (point_ - eye_).normalized();
  const Eigen::Vector3d across = along.unitOrthogonal();
  const Eigen::Vector3d third = along.cross(across);
  for (const Eigen::Vector3d& move : {across, third, Eigen::Vector3d(Eigen::Vector3d::UnitZ())})
    for (const double size_m : {-kTie_m, kTie_m})
      if (is_seen(eye_ + size_m * move, point_) != is_seen_here ||
          is_seen(eye_, point_ + size_m * move) != is_seen_here)
        return true;
  return false;
}

double Sight::distance_from_ground_m() const {
  const std::optional<ExactHit> hit = terrain_.first_hit({eye_, point_});
  if (!hit) return std::numeric_limits<double>::infinity();
  return std::abs((hit->t - 1.0) * hit->normal_world.dot(point_ - eye_));
}

// The ground's first point on the way is the point itself: as far along the normal of the triangle
// there as the point's rounding goes.
bool Sight::is_seen(const Eigen::Vector3d& eye, const Eigen::Vector3d& point) const {
  const std::optional<ExactHit> hit = terrain_.first_hit({eye, point}, 1.0);
  if (!hit) return true;
  return std::abs((1.0 - hit->t) * hit->normal_world.dot(point - eye)) <= kPointRounding_m &&
         (1.0 - hit->t) * (point - eye).norm() <= kMostAlong_m;
}

}  // namespace terracast::validate
