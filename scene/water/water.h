#pragma once

#include <cstdint>

#include "scene/ground/ground.h"

namespace terracast::scene {

/// Looks of the lanes whose cover is water; others stay. Waves from 64 m at sea, 4 m on lakes and 2 m on rivers
/// to 12 cm, whose slopes too small for the footprint become variance; streaks of wind, at sea foam.
void look_at_water(const GroundPacket& packet, std::uint32_t seed, GroundLook& look);

/// Looks of the lanes whose cover is the bed below water: sand, rock, seagrass as world/sea_bed.h has it; others stay.
void look_at_bed(const GroundPacket& packet, std::uint32_t seed, GroundLook& look);

}  // namespace terracast::scene
