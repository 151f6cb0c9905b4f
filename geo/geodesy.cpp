#include "geo/geodesy.h"

#include <GeographicLib/Geocentric.hpp>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace terracast::geo {
namespace {

void check_geodetic(const Geodetic& point) {
  if (!std::isfinite(point.lat_deg) || !std::isfinite(point.lon_deg) ||
      !std::isfinite(point.height_m)) {
    core::fail(core::ErrorKind::Input,
               "geodetic point (lat {} deg, lon {} deg, height {} m) is not finite", point.lat_deg,
               point.lon_deg, point.height_m);
  }
  if (std::abs(point.lat_deg) > 90.0) {
    core::fail(core::ErrorKind::Input, "latitude {} deg is outside -90 to 90 (longitude {} deg)",
               point.lat_deg, point.lon_deg);
  }
}

void check_finite(const Eigen::Vector3d& point, const char* frame) {
  if (!point.allFinite()) {
    core::fail(core::ErrorKind::Input, "{} point ({}, {}, {}) m is not finite", frame, point.x(),
               point.y(), point.z());
  }
}

/// Columns east, north, up of the place that GeographicLib's 3 x 3 row-major matrix describes.
Eigen::Matrix3d ecef_from_enu(const std::vector<double>& row_major) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row_major.data());
}

/// Rotation whose columns are east, north and up of a point in ecef, and the point's geodetic form.
Eigen::Matrix3d ecef_from_enu(const Eigen::Vector3d& point_ecef) {
  Geodetic place;
  std::vector<double> rotation(9);
  GeographicLib::Geocentric::WGS84().Reverse(point_ecef.x(), point_ecef.y(), point_ecef.z(),
                                             place.lat_deg, place.lon_deg, place.height_m,
                                             rotation);
  return ecef_from_enu(rotation);
}

}  // namespace

Eigen::Vector3d ecef_from_geodetic(const Geodetic& point) {
  check_geodetic(point);
  Eigen::Vector3d ecef;
  GeographicLib::Geocentric::WGS84().Forward(point.lat_deg, point.lon_deg, point.height_m, ecef.x(),
                                             ecef.y(), ecef.z());
  return ecef;
}

Geodetic geodetic_from_ecef(const Eigen::Vector3d& point_ecef) {
  check_finite(point_ecef, "ecef");
  Geodetic place;
  GeographicLib::Geocentric::WGS84().Reverse(point_ecef.x(), point_ecef.y(), point_ecef.z(),
                                             place.lat_deg, place.lon_deg, place.height_m);
  return place;
}

// LocalCartesian is this rotation and translation behind a forward and a reverse call; holding them
// as a Rigid3d keeps GeographicLib out of the header and gives the transform to those who chain it.
WorldFrame::WorldFrame(const Geodetic& origin) : origin_(origin) {
  check_geodetic(origin);
  std::vector<double> rotation(9);
  Eigen::Vector3d& at = ecef_from_world_.translation;
  GeographicLib::Geocentric::WGS84().Forward(origin.lat_deg, origin.lon_deg, origin.height_m,
                                             at.x(), at.y(), at.z(), rotation);
  ecef_from_world_.rotation = Eigen::Quaterniond(ecef_from_enu(rotation)).normalized();
}

Eigen::Vector3d WorldFrame::world_from_geodetic(const Geodetic& point) const {
  // The difference is taken first: rotating 6 400 km would cost three digits of a metre's fraction.
  return ecef_from_world_.rotation.conjugate() *
         (ecef_from_geodetic(point) - ecef_from_world_.translation);
}

Geodetic WorldFrame::geodetic_from_world(const Eigen::Vector3d& point_world) const {
  check_finite(point_world, "world");
  return geodetic_from_ecef(ecef_from_world_ * point_world);
}

Eigen::Vector3d WorldFrame::up_world(const Eigen::Vector3d& point_world) const {
  return world_from_enu(point_world).col(2);
}

Eigen::Matrix3d WorldFrame::world_from_enu(const Eigen::Vector3d& point_world) const {
  check_finite(point_world, "world");
  return ecef_from_world_.rotation.conjugate().toRotationMatrix() *
         ecef_from_enu(Eigen::Vector3d(ecef_from_world_ * point_world));
}

// Blaschke's rolling theorem: a ball of the ellipsoid's largest radius of curvature R, touching it
// inside out at any point, holds the whole ellipsoid. Let P be a seen point, n its normal, C = P -
// R n the centre of the ball at P and E the eye, h above its foot. The foot lies in the ball, so |E
// - C| <= R + h; E is on the outer side of the tangent plane at P, so |E - C|^2 >= |E - P|^2 + R^2.
// Hence |E - P|^2 <= (R + h)^2 - R^2.
double horizon_distance_m(double height_m) {
  constexpr double kLargestRadius_m = kWgs84SemiMajorAxis_m / (1.0 - kWgs84Flattening);
  const double h = std::max(height_m, 0.0);
  return std::sqrt(h * (2.0 * kLargestRadius_m + h));
}

}  // namespace terracast::geo
