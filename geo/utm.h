#pragma once

namespace terracast::geo {

/// A place on the map of a zone of UTM.
struct UtmPlace {
  double easting_m = 0.0;
  double northing_m = 0.0;  ///< south of the equator with 10 000 km added
};

/// A zone of UTM: 1 to 60, and a half of the Earth.
struct UtmZone {
  int number = 0;
  bool is_north = true;

  /// WGS 84 / UTM: 32601 to 32660, and 32701 to 32760.
  int epsg() const { return (is_north ? 32600 : 32700) + number; }
  double central_meridian_deg() const { return 6.0 * number - 183.0; }
};

/// The zone of a place, with the exceptions of Norway and Svalbard.
/// throws   Config: a latitude beyond UTM's, which ends at 80 deg south and 84 deg north
UtmZone utm_zone(double lat_deg, double lon_deg);

/// A place on the map of a zone, its own or one near by.
/// accuracy   5 nm (GeographicLib's statement)
/// throws     Input: too far from the zone
UtmPlace utm_from_geodetic(const UtmZone& zone, double lat_deg, double lon_deg);

}  // namespace terracast::geo
