#pragma once

#include "geo/geodesy.h"
#include "geo/paths/path.h"

namespace terracast::geo {

/// World coordinates whose third axis follows the Earth's curve: (x, y, w) with w = z + x^2 / 2N +
/// y^2 / 2M, N and M the ellipsoid's radii of curvature at the origin. Constant w is constant
/// height to the third order of the distance (a few centimetres at 25 km), so that what is straight
/// here flies level there.
class Flattened {
 public:
  explicit Flattened(const Geodetic& origin);

  Eigen::Vector3d flattened_from_world(const Eigen::Vector3d& point_world) const;
  /// The same point and derivatives in the world.
  PathPoint world_from_flattened(const PathPoint& point) const;

 private:
  double per_east_radius_;
  double per_north_radius_;
};

}  // namespace terracast::geo
