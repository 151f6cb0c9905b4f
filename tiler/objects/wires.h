#pragma once

#include <cstdint>

#include "world/instance_frame.h"
#include "world/tile_objects.h"

namespace terracast::tiler {

/// Wires are not shown on coarser tiles: there they are a fiftieth of a pixel wide.
inline constexpr int kCoarsestWireLevel = 2;

/// The wires from one support to the next, each a closed tube along its catenary; provenance is not set.
/// from_thing, to_thing   rows of all_things()
world::Solid wires_between(std::uint32_t from_thing, const world::InstanceFrame& from,
                           std::uint32_t to_thing, const world::InstanceFrame& to);

}  // namespace terracast::tiler
