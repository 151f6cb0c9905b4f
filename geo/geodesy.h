#pragma once

#include <Eigen/Core>
#include <memory>

#include "geo/rigid3.h"

namespace terracast::geo {

/// A point of WGS84: latitude and longitude in degrees, height above the ellipsoid in metres.
struct Geodetic {
  double lat_deg = 0.0;
  double lon_deg = 0.0;
  double height_m = 0.0;
  bool operator==(const Geodetic&) const = default;
};

/// WGS84 (EPSG:4979): semi-major axis and flattening.
inline constexpr double kWgs84SemiMajorAxis_m = 6378137.0;
inline constexpr double kWgs84Flattening = 1.0 / 298.257223563;

/// Earth-centred, Earth-fixed position of a geodetic point, m.
/// accuracy   10 nm within 5000 km of the ellipsoid (GeographicLib's statement); tests against
///            published points
/// throws     Input: latitude out of [-90, 90] or a value that is not finite
/// threads    safe
Eigen::Vector3d ecef_from_geodetic(const Geodetic& point);
Geodetic geodetic_from_ecef(const Eigen::Vector3d& point_ecef);

/// The world's tangent frame at a geodetic origin (GeographicLib LocalCartesian). Threads: safe.
class WorldFrame {
 public:
  /// throws Input: as ecef_from_geodetic
  explicit WorldFrame(const Geodetic& origin);

  const Geodetic& origin() const { return origin_; }
  const Rigid3d& ecef_from_world() const { return ecef_from_world_; }

  Eigen::Vector3d world_from_geodetic(const Geodetic& point) const;
  Geodetic geodetic_from_world(const Eigen::Vector3d& point_world) const;

  /// The ellipsoid's outward unit normal through the point: "up" there.
  Eigen::Vector3d up_world(const Eigen::Vector3d& point_world) const;

  /// Rotation whose columns are east, north and up of the place, in the world.
  Eigen::Matrix3d world_from_enu(const Eigen::Vector3d& point_world) const;

 private:
  Geodetic origin_;
  Rigid3d ecef_from_world_;
};

/// Distance along the line of sight from `height_m` above the ellipsoid to its horizon, of the
/// osculating sphere with the largest radius: no point of the ellipsoid that is seen lies farther.
double horizon_distance_m(double height_m);

}  // namespace terracast::geo
