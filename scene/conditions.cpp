#include "scene/conditions.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/sun.h"
#include "geo/units.h"

namespace terracast::scene {

using core::ErrorKind;
using core::fail;

void ConditionOptions::describe(core::SchemaVisitor& visit) {
  visit.key("visibility_km", visibility_km,
            "Meteorological range at sea level: how clear the air is.", core::between(1.0, 300.0));
  visit.key(
      "water_visibility_m", water_visibility_m,
      "How far one sees under water, at sea: 40 in clear ocean, 15 at a coast, 3 in a harbour; "
      "lakes are 0.4 as clear, rivers 0.2.",
      core::between(0.5, 80.0));
  visit.key("bottom_range", bottom_range,
            "Whether the capture also holds bottom_range_m: each ray's range in the world without "
            "water, to the bed of the sea, of lakes and of rivers.");
  visit.key("sun_azimuth_deg", sun_azimuth_deg,
            "Azimuth of the sun, clockwise from north; -1: from place and UTC.",
            core::between(-1.0, 360.0));
  visit.key("sun_elevation_deg", sun_elevation_deg,
            "Elevation of the sun above the horizontal; -91: from place and UTC.",
            core::between(-91.0, 90.0));
  visit.key("exposure", exposure,
            "Factor on the exposure, which is set once a sequence by its light.",
            core::between(0.01, 100.0));
  visit.key("color_samples", color_samples, "Rays a pixel for colour.", core::between(1, 256));
  visit.key("ambient_rays", ambient_rays,
            "Rays a colour sample that look how much of the sky is hidden by what stands within 30 "
            "m: soft "
            "shade under trees and between houses. 0: none looks, crowns are darkened by estimate.",
            core::between(0, 16));
  visit.list("media", media, "Haze and the like, beside the air and the world's clouds.");
}

void ConditionOptions::validate() const {
  if (sun_azimuth_deg < 0.0 && sun_azimuth_deg != -1.0) {
    fail(ErrorKind::Config, "sun_azimuth_deg = {}; it takes 0 to 360, or -1 for place and UTC",
         sun_azimuth_deg);
  }
  if (sun_elevation_deg < -90.0 && sun_elevation_deg != -91.0) {
    fail(ErrorKind::Config, "sun_elevation_deg = {}; it takes -90 to 90, or -91 for place and UTC",
         sun_elevation_deg);
  }
  if (ambient_rays < 0 || ambient_rays > 16)
    fail(ErrorKind::Config, "ambient_rays = {}; it takes 0 to 16", ambient_rays);
  if (color_samples < 1 || color_samples > 256) {
    fail(ErrorKind::Config, "color_samples = {}; it takes 1 to 256", color_samples);
  }
}

Daylight daylight_at(const Eigen::Vector3d& position_world, const std::string& utc,
                     const ConditionOptions& conditions, const geo::WorldFrame& frame) {
  Daylight daylight;
  daylight.up_world = frame.up_world(position_world);
  daylight.visibility_m = conditions.visibility_km * 1e3;
  daylight.sun_direction_world = geo::sun_direction_world(
      frame, frame.geodetic_from_world(position_world), geo::unix_seconds_from_utc(utc));
  if (conditions.has_sun_azimuth() || conditions.has_sun_elevation()) {
    const Eigen::Matrix3d world_from_enu = frame.world_from_enu(position_world);
    const Eigen::Vector3d sun_enu = world_from_enu.transpose() * daylight.sun_direction_world;
    double azimuth = std::atan2(sun_enu.x(), sun_enu.y());
    double elevation = std::asin(std::clamp(sun_enu.z(), -1.0, 1.0));
    if (conditions.has_sun_azimuth())
      azimuth = geo::radians_from_degrees(conditions.sun_azimuth_deg);
    if (conditions.has_sun_elevation())
      elevation = geo::radians_from_degrees(conditions.sun_elevation_deg);
    daylight.sun_direction_world =
        world_from_enu * Eigen::Vector3d(std::cos(elevation) * std::sin(azimuth),
                                         std::cos(elevation) * std::cos(azimuth),
                                         std::sin(elevation));
  }
  return daylight;
}

}  // namespace terracast::scene
