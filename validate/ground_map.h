#pragma once

#include <functional>
#include <optional>

#include "core/image.h"

/// The map below the page's footprints, where somebody knows the ground.
namespace terracast::validate {

/// A rectangle of a sequence's local frame, m; the frame stands at `lat_deg`, `lon_deg` on the
/// ellipsoid's height `height_m`.
struct MapArea {
  double lat_deg = 0.0, lon_deg = 0.0, height_m = 0.0;
  double west_m = 0.0, east_m = 0.0, south_m = 0.0, north_m = 0.0;
};

/// Draws the ground of an area from above: 3 channels, north up, the longer side of `size_px`.
/// Nothing where the area is of another world.
using GroundMapMaker = std::function<std::optional<core::Image8>(const MapArea& area, int size_px)>;

}  // namespace terracast::validate
