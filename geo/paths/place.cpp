#include "geo/paths/place.h"

#include <cmath>

#include "core/error.h"

namespace terracast::geo {

// A pair that the config did not give is not a number, which TOML readers refuse: once the other
// pair is known it is left out of the description.
void Place::describe_on_map(core::SchemaVisitor& visit) {
  const bool is_geodetic = !std::isnan(lat_deg) && !std::isnan(lon_deg);
  const bool is_enu = !std::isnan(east_m) && !std::isnan(north_m);
  if (is_geodetic || !is_enu) {
    visit.key("lat_deg", lat_deg, "Latitude (WGS84), with lon_deg; or east_m and north_m.",
              core::between(-90.0, 90.0));
    visit.key("lon_deg", lon_deg, "Longitude (WGS84).", core::between(-360.0, 360.0));
  }
  if (is_enu || !is_geodetic) {
    visit.key("east_m", east_m, "World x, with north_m; instead of lat_deg and lon_deg.");
    visit.key("north_m", north_m, "World y.");
  }
}

void Place::describe(core::SchemaVisitor& visit) {
  describe_on_map(visit);
  visit.key("height_m", height_m, "Height above what `above` says.",
            core::between(-12000.0, 1000000.0));
  visit.key("above", above, "What height_m counts from: WGS84, mean sea level (EGM96), the ground.",
            core::one_of({"ellipsoid", "egm96", "ground"}));
}

void Place::validate() const {
  const int num_geodetic = (std::isnan(lat_deg) ? 0 : 1) + (std::isnan(lon_deg) ? 0 : 1);
  const int num_enu = (std::isnan(east_m) ? 0 : 1) + (std::isnan(north_m) ? 0 : 1);
  if (num_geodetic + num_enu != 2 || num_geodetic == 1) {
    core::fail(
        core::ErrorKind::Config,
        "a place needs lat_deg and lon_deg, or east_m and north_m: {} of the first two and {} of "
        "the others are given",
        num_geodetic, num_enu);
  }
}

std::string text_of(const Geodetic& place) {
  return fmt::format("lat {:.7f}, lon {:.7f}", place.lat_deg, place.lon_deg);
}

Eigen::Vector3d resolve_place(const Place& place, const TrajectoryContext& context,
                              const std::string& what) {
  core::with_context([&] { place.validate(); }, "reading " + what);
  // Ellipsoidal height of the place above (lat, lon).
  const auto ellipsoidal_height_m = [&](double lat_deg, double lon_deg) {
    if (place.above == "ellipsoid") return place.height_m;
    if (place.above == "egm96") {
      if (!context.geoid) {
        core::fail(core::ErrorKind::Config,
                   "{}: above = \"egm96\" needs a geoid, and this world has none", what);
      }
      return place.height_m + context.geoid->undulation_m(lat_deg, lon_deg);
    }
    const std::optional<double> ground_m = context.ground_height_m(lat_deg, lon_deg);
    if (!ground_m) {
      core::fail(
          core::ErrorKind::Input,
          "{}: the world has no ground at {}; choose a place inside it, or heights above the "
          "ellipsoid or egm96",
          what, text_of({lat_deg, lon_deg, 0.0}));
    }
    return place.height_m + *ground_m;
  };
  if (!std::isnan(place.lat_deg)) {
    return context.frame.world_from_geodetic(
        {place.lat_deg, place.lon_deg, ellipsoidal_height_m(place.lat_deg, place.lon_deg)});
  }
  // x and y are given, z follows from the height. Up leans from z by an angle of distance / 6 400
  // km, so each round leaves a thousandth of the error or less.
  Eigen::Vector3d point_world(place.east_m, place.north_m, 0.0);
  for (int i = 0; i < 20; ++i) {
    const Geodetic at = context.frame.geodetic_from_world(point_world);
    const double missing_m = ellipsoidal_height_m(at.lat_deg, at.lon_deg) - at.height_m;
    point_world.z() += missing_m;
    if (std::abs(missing_m) < 1e-9) break;
  }
  return point_world;
}

}  // namespace terracast::geo
