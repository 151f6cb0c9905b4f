#pragma once

#include <cstdint>

#include "tiler/buildings/building_design.h"

namespace terracast::tiler {

/// Chooses the materials and colours of a building's walls, roof and trim, and the pattern of its
/// windows: as its tags say, else as its kind, surroundings and country have them.
/// town, own   as design_building() has them
/// design      with its kind, storeys, height and roof
void choose_finishes(const FeatureTags& tags, const Surroundings& around, std::uint64_t town,
                     std::uint64_t own, BuildingDesign& design);

}  // namespace terracast::tiler
