#include "geo/paths/flattened.h"

#include <cmath>

#include "geo/units.h"

namespace terracast::geo {

Flattened::Flattened(const Geodetic& origin) {
  const double sin_lat = std::sin(radians_from_degrees(origin.lat_deg));
  const double e2 = kWgs84Flattening * (2.0 - kWgs84Flattening);
  const double w2 = 1.0 - e2 * sin_lat * sin_lat;
  const double prime_vertical_m = kWgs84SemiMajorAxis_m / std::sqrt(w2);
  per_east_radius_ = 1.0 / (prime_vertical_m + origin.height_m);
  per_north_radius_ = 1.0 / (prime_vertical_m * (1.0 - e2) / w2 + origin.height_m);
}

Eigen::Vector3d Flattened::flattened_from_world(const Eigen::Vector3d& p) const {
  return {p.x(), p.y(),
          p.z() + 0.5 * (p.x() * p.x() * per_east_radius_ + p.y() * p.y() * per_north_radius_)};
}

PathPoint Flattened::world_from_flattened(const PathPoint& point) const {
  PathPoint world = point;
  const Eigen::Vector3d& p = point.position_world;
  const Eigen::Vector3d& d = point.first;
  const Eigen::Vector3d& dd = point.second;
  const Eigen::Vector3d& ddd = point.third;
  world.position_world.z() -=
      0.5 * (p.x() * p.x() * per_east_radius_ + p.y() * p.y() * per_north_radius_);
  world.first.z() -= p.x() * d.x() * per_east_radius_ + p.y() * d.y() * per_north_radius_;
  world.second.z() -= (d.x() * d.x() + p.x() * dd.x()) * per_east_radius_ +
                      (d.y() * d.y() + p.y() * dd.y()) * per_north_radius_;
  world.third.z() -= (3.0 * d.x() * dd.x() + p.x() * ddd.x()) * per_east_radius_ +
                     (3.0 * d.y() * dd.y() + p.y() * ddd.y()) * per_north_radius_;
  return world;
}

}  // namespace terracast::geo
