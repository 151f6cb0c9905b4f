#pragma once

#include <cstdint>

#include "tiler/buildings/building_design.h"
#include "tiler/buildings/footprint.h"

namespace terracast::tiler {

/// Of walls above the highest ground, so that slopes do not come up to the roof.
inline constexpr double kClearOfGround_m = 2.2;
/// By which roofs stand out of walls, times 0.6 to kMostOverhang.
inline constexpr double kEaves_m = 0.4;
inline constexpr double kMostOverhang = 1.3;
inline constexpr double kFascia_m = 0.16;

/// How high the parapet of a flat roof is, in whole decimetres: so setbacks keep the roofs of
/// bodies over each other apart as well.
/// own   drawn for the building
double parapet_m(std::uint64_t own);

/// No pitched roof is higher.
double highest_roof_m(const BuildingDesign& design);

/// How far below a building's top its roof may lie: of a flat one the floor behind its parapet, of
/// others the eaves. Never less than it is; in whole decimetres, so that setbacks keep what goes
/// down to it apart.
double roof_depth_m(const BuildingDesign& design, const RingsSteps& rings, std::uint64_t own);

}  // namespace terracast::tiler
