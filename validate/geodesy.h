#pragma once

#include "validate/geometry.h"

/// The validator's own WGS84.
namespace terracast::validate {

struct Geodetic {
  double lat_deg = 0.0;
  double lon_deg = 0.0;
  double height_m = 0.0;  ///< above the ellipsoid
};

/// accuracy  rounding only: 2e-9 m
Eigen::Vector3d ecef_from_geodetic(const Geodetic& place);

/// accuracy  1e-9 m in height and in place, from 5000 km below the surface of the ellipsoid (its centre excluded) outward
Geodetic geodetic_from_ecef(const Eigen::Vector3d& point_ecef);

/// Rows: east, north, up of the ellipsoid's normal at that place.
Eigen::Matrix3d enu_from_ecef(const Geodetic& place);

/// The tangent frame (east, north, up) at an origin, as a rigid motion.
Pose ecef_from_local(const Geodetic& origin);

}  // namespace terracast::validate
