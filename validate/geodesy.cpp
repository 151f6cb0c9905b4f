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

Eigen::Vector2d utm_from_geodetic(int epsg, double lat_deg, double lon_deg) {
  constexpr double kScale = 0.9996, kFalseEasting_m = 5e5, kFalseNorthing_m = 1e7;
  const double flattening = 1.0 / 298.257223563;
  const double n = flattening / (2.0 - flattening);
  const double e = std::sqrt(flattening * (2.0 - flattening));
  const double n2 = n * n, n3 = n2 * n, n4 = n3 * n, n5 = n4 * n, n6 = n5 * n;
  const double radius_m = 6378137.0 / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0 + n6 / 256.0);
  const std::array<double, 6> alpha = {
      n / 2.0 - 2.0 * n2 / 3.0 + 5.0 * n3 / 16.0 + 41.0 * n4 / 180.0 - 127.0 * n5 / 288.0 +
          7891.0 * n6 / 37800.0,
      13.0 * n2 / 48.0 - 3.0 * n3 / 5.0 + 557.0 * n4 / 1440.0 + 281.0 * n5 / 630.0 -
          1983433.0 * n6 / 1935360.0,
      61.0 * n3 / 240.0 - 103.0 * n4 / 140.0 + 15061.0 * n5 / 26880.0 + 167603.0 * n6 / 181440.0,
      49561.0 * n4 / 161280.0 - 179.0 * n5 / 168.0 + 6601661.0 * n6 / 7257600.0,
      34729.0 * n5 / 80640.0 - 3418889.0 * n6 / 1995840.0,
      212378941.0 * n6 / 319334400.0};
  const double meridian_deg = 6.0 * (epsg % 100) - 183.0;
  const double lon = std::remainder(lon_deg - meridian_deg, 360.0) * kPi / 180.0;
  const double tau = std::tan(lat_deg * kPi / 180.0);
  const double sigma = std::sinh(e * std::atanh(e * tau / std::hypot(1.0, tau)));
  const double conformal = tau * std::hypot(1.0, sigma) - sigma * std::hypot(1.0, tau);
  const double xi = std::atan2(conformal, std::cos(lon));
  const double eta = std::asinh(std::sin(lon) / std::hypot(conformal, std::cos(lon)));
  double north = xi, east = eta;
  for (std::size_t j = 0; j < alpha.size(); ++j) {
    const double twice = 2.0 * static_cast<double>(j + 1);
    north += alpha[j] * std::sin(twice * xi) * std::cosh(twice * eta);
    east += alpha[j] * std::cos(twice * xi) * std::sinh(twice * eta);
  }
  return {kFalseEasting_m + kScale * radius_m * east,
          (epsg >= 32700 ? kFalseNorthing_m : 0.0) + kScale * radius_m * north};
}

}  // namespace terracast::validate
