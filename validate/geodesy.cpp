#include "validate/geodesy.h"

namespace terracast::validate {

namespace {

constexpr double kSemiMajorAxis_m = 6378137.0;
constexpr double kFlattening = 1.0 / 298.257223563;
constexpr double kEccentricitySquared = kFlattening * (2.0 - kFlattening);

double prime_vertical_radius_m(double sine_lat) {
  return kSemiMajorAxis_m / std::sqrt(1.0 - kEccentricitySquared * sine_lat * sine_lat);
}

}  // namespace

Eigen::Vector3d ecef_from_geodetic(const Geodetic& place) {
  const double lat = radians_from_degrees(place.lat_deg);
  const double lon = radians_from_degrees(place.lon_deg);
  const double radius_m = prime_vertical_radius_m(std::sin(lat));
  const double from_axis_m = (radius_m + place.height_m) * std::cos(lat);
  return {from_axis_m * std::cos(lon), from_axis_m * std::sin(lon),
          (radius_m * (1.0 - kEccentricitySquared) + place.height_m) * std::sin(lat)};
}

Geodetic geodetic_from_ecef(const Eigen::Vector3d& point_ecef) {
  const double from_axis_m = std::hypot(point_ecef.x(), point_ecef.y());
  // Bowring (1976): tan(lat) = (z + e'^2 b sin^3 beta) / (p - e^2 a cos^3 beta), with the
  // parametric latitude beta taken from the last latitude. Each turn gains a factor of about 1e-5
  // near the surface, so that four leave rounding alone.
  constexpr double kAxisRatio = 1.0 - kFlattening;
  constexpr double kSecondEccentricitySquared = kEccentricitySquared / (1.0 - kEccentricitySquared);
  double parametric = std::atan2(point_ecef.z(), kAxisRatio * from_axis_m);
  double lat = 0.0;
  for (int turn = 0; turn < 6; ++turn) {
    const double sine = std::sin(parametric);
    const double cosine = std::cos(parametric);
    lat = std::atan2(
        point_ecef.z() +
            kSecondEccentricitySquared * kSemiMajorAxis_m * kAxisRatio * sine * sine * sine,
        from_axis_m - kEccentricitySquared * kSemiMajorAxis_m * cosine * cosine * cosine);
    parametric = std::atan2(kAxisRatio * std::sin(lat), std::cos(lat));
  }
  const double sine = std::sin(lat);
  // The distance along the normal, in the form that is sound at the equator and at the poles.
  const double height_m = from_axis_m * std::cos(lat) + point_ecef.z() * sine -
                          kSemiMajorAxis_m * std::sqrt(1.0 - kEccentricitySquared * sine * sine);
  return {degrees_from_radians(lat),
          degrees_from_radians(std::atan2(point_ecef.y(), point_ecef.x())), height_m};
}

Eigen::Matrix3d enu_from_ecef(const Geodetic& place) {
  const double lat = radians_from_degrees(place.lat_deg);
  const double lon = radians_from_degrees(place.lon_deg);
  Eigen::Matrix3d rotation;
  rotation << -std::sin(lon), std::cos(lon), 0.0,                                     //
      -std::sin(lat) * std::cos(lon), -std::sin(lat) * std::sin(lon), std::cos(lat),  //
      std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat);
  return rotation;
}

Pose ecef_from_local(const Geodetic& origin) {
  return {enu_from_ecef(origin).transpose(), ecef_from_geodetic(origin)};
}

}  // namespace terracast::validate
