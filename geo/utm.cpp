#include "geo/utm.h"

#include <GeographicLib/UTMUPS.hpp>

#include "core/error.h"

namespace terracast::geo {

using core::ErrorKind;
using core::fail;
using GeographicLib::UTMUPS;

UtmZone utm_zone(double lat_deg, double lon_deg) {
  const int zone = UTMUPS::StandardZone(lat_deg, lon_deg);
  if (zone < UTMUPS::MINUTMZONE)
    fail(ErrorKind::Config, "latitude {} has no zone of UTM, whose map ends at -80 and 84 degrees",
         lat_deg);
  return {.number = zone, .is_north = lat_deg >= 0.0};
}

UtmPlace utm_from_geodetic(const UtmZone& zone, double lat_deg, double lon_deg) {
  UtmPlace place;
  int number = 0;
  bool is_north = true;
  try {
    UTMUPS::Forward(lat_deg, lon_deg, number, is_north, place.easting_m, place.northing_m,
                    zone.number);
  } catch (const std::exception& error) {
    fail(ErrorKind::Input, "{}, {} is no place of zone {} of UTM: {}", lat_deg, lon_deg,
         zone.number, error.what());
  }
  // On the map of the other half of the Earth.
  constexpr double kSouth_m = 1e7;
  if (is_north != zone.is_north) place.northing_m += zone.is_north ? -kSouth_m : kSouth_m;
  return place;
}

}  // namespace terracast::geo
