#pragma once

#include <optional>
#include <vector>

#include "tiler/roads/way_style.h"
#include "world/tile_objects.h"

namespace terracast::tiler {

/// A quay, a broad pier or a breakwater: the body over an area between two heights.
/// ring_world   closed by its first point, which is not repeated; either way round
/// low_z, high_z   in the world frame
/// returns      nullopt: the ring crosses itself, touches itself or is too small; its id and feature are not
///              set
std::optional<world::Solid> build_area_pier(const PointsWorld& ring_world, double low_z,
                                            double high_z, bool is_stone);

}  // namespace terracast::tiler
