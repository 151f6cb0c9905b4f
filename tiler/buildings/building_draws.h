#pragma once

#include <cstdint>

namespace terracast::tiler {

/// What is drawn for a building (Building::own) or its town: the numbers of its streams of random
/// numbers. A number that changes changes the world.
enum BuildingDraw : std::uint64_t {
  // Design.
  kStoreys = 0,
  kStorey = 1,
  kRoof = 2,
  kSlope = 3,
  // Finishes.
  kWallColor = 4,
  kWallMaterial = 5,
  kRoofColor = 6,
  kShade = 7,
  kStyle = 8,
  kTint = 9,
  // Surface.
  kParapet = 32,
  kOverhang = 36,
  kBays = 37,
  // What stands on roofs.
  kChimney = 33,
  kPlant = 34,
  kNumPlant = 35,
  kPlantSize = 43,
  kChimneyLength = 49,
  kChimneyHeight = 50,
};

}  // namespace terracast::tiler
