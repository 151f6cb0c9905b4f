#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/schema.h"
#include "geo/geodesy.h"
#include "scene/light/sky.h"
#include "scene/media/medium.h"

namespace terracast::scene {

/// Config `[conditions]`: light and air.
struct ConditionOptions {
  double visibility_km = 60.0;       ///< meteorological range, sets the aerial perspective
  bool bottom_range = false;         ///< store the channel bottom_range_m
  double water_visibility_m = 20.0;  ///< under water at sea, by which all waters are known
  double sun_azimuth_deg = -1.0;     ///< -1: from place and UTC
  double sun_elevation_deg = -91.0;  ///< -91: from place and UTC
  double exposure = 1.0;
  std::int64_t color_samples = 4;  ///< rays a pixel for colour
  std::int64_t ambient_rays =
      0;  ///< rays a sample that look how much of the sky things near by hide

  std::vector<MediumChoice> media = {};  ///< beside air and clouds

  bool has_sun_azimuth() const { return sun_azimuth_deg >= 0.0; }
  bool has_sun_elevation() const { return sun_elevation_deg >= -90.0; }

  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// The light at a position and a time: the sun as the conditions place it, and the air.
/// position_world   m
/// utc              as geo::unix_seconds_from_utc takes it
Daylight daylight_at(const Eigen::Vector3d& position_world, const std::string& utc,
                     const ConditionOptions& conditions, const geo::WorldFrame& frame);

}  // namespace terracast::scene
