#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "geo/paths/continuity.h"
#include "geo/paths/path.h"
#include "geo/paths/place.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// A path through places: an interpolating spline in flattened coordinates, by the length of the chords.
struct SplineThroughPlaces {
  std::shared_ptr<const Path> path;
  std::vector<double> parameters;  ///< of the places; closed: the first one again at the end
  /// "raise waypoint 3 (counted from 0)"
  std::function<std::string(double u)> how_to_raise;
};

/// places   two or more; closed: three or more
/// throws   Config: two neighbours within a centimetre; as resolve_place()
SplineThroughPlaces spline_through(const std::vector<Place>& places, bool is_closed,
                                   Continuity continuity, const TrajectoryContext& context);

}  // namespace terracast::geo
