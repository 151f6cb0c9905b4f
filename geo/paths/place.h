#pragma once

#include <limits>
#include <string>

#include "core/schema.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// A point that a config names: geodetic or in the world's own metres, and a height that says above
/// what.
struct Place {
  static constexpr double kNotGiven = std::numeric_limits<double>::quiet_NaN();

  double lat_deg = kNotGiven;
  double lon_deg = kNotGiven;
  double east_m = kNotGiven;
  double north_m = kNotGiven;
  double height_m = 0.0;
  std::string above = "ground";

  void describe(core::SchemaVisitor& visit);
  /// The keys of its place without those of its height.
  void describe_on_map(core::SchemaVisitor& visit);
  /// throws Config: neither or both of the two pairs, or half of one
  void validate() const;
};

/// Position in the world.
/// throws Config: heights above the geoid without a geoid; Input: no ground there. `what` names the
/// place.
Eigen::Vector3d resolve_place(const Place& place, const TrajectoryContext& context,
                              const std::string& what);

/// "lat 42.512345, lon 1.534567": seven digits are 1 cm.
std::string text_of(const Geodetic& place);

}  // namespace terracast::geo
