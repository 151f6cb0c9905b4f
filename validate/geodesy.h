#pragma once

#include "validate/geometry.h"

/// The validator's own WGS84.
namespace terracast::validate {

struct Geodetic {
  double lat_deg = 0.0;
  double lon_deg = 0.0;
  double height_m = 0.0;  ///< above the ellipsoid
};

/// accuracy  1e-8 m at the equator and the poles; ValidateGeodesy
Eigen::Vector3d ecef_from_geodetic(const Geodetic& place);

/// accuracy  4e-9 m in place, 3e-9 m in height, from 5 km below the ellipsoid to 400 km above it;
///           ValidateGeodesy
Geodetic geodetic_from_ecef(const Eigen::Vector3d& point_ecef);

/// Rows: east, north, up of the ellipsoid's normal at that place.
Eigen::Matrix3d enu_from_ecef(const Geodetic& place);

/// The tangent frame (east, north, up) at an origin, as a rigid motion.
Pose ecef_from_local(const Geodetic& origin);

/// Easting and northing of a place on the map of a zone of UTM.
/// epsg      32601 to 32660, 32701 to 32760
/// accuracy  1e-8 m within 4000 km of the zone's meridian: Krüger's series to the sixth order (Karney 2011, J. Geodesy 85)
Eigen::Vector2d utm_from_geodetic(int epsg, double lat_deg, double lon_deg);

}  // namespace terracast::validate
