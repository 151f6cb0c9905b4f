#pragma once

#include <cstdint>

#include "render/material.h"

namespace terracast::render {

/// Whether a cover is the surface of water.
inline bool is_water(world::Cover cover) {
  return cover == world::Cover::Sea || cover == world::Cover::Lake || cover == world::Cover::River;
}

/// Looks of the lanes whose cover is water; others stay. Waves from 64 m to 12 cm, higher at sea, whose
/// slopes too small for the footprint become variance; streaks of wind, at sea foam.
void look_at_water(const GroundPacket& packet, std::uint32_t seed, GroundLook& look);

}  // namespace terracast::render
