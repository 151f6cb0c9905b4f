#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace terracast::core {

/// What a point of the world is. The numbers stand in files and never change their meaning.
enum class SemanticClass : std::uint8_t {
  Sky = 0,
  Outside = 1,  ///< land of the apron, beyond the world
  Sea = 2,
  Rock = 3,
  Scree = 4,
  Grass = 5,
  Soil = 6,
  Sand = 7,
  Snow = 8,
  ForestFloor = 9,
  Shrubland = 10,
  Cropland = 11,
  Wetland = 12,
  BuiltUp = 13,  ///< paved or bare ground of towns
  Lake = 14,
  River = 15,
  Seabed = 16,  ///< ground below any water
  Road = 17,
  RoadMarking = 18,
  Path = 19,  ///< footways, tracks, sidewalks
  Railway = 20,
  Runway = 21,
  Taxiway = 22,
  Apron = 23,
  Parking = 24,
  Building = 25,
  Bridge = 26,
  Wall = 27,  ///< walls and fences that are no buildings
  Tree = 28,
  Bush = 29,
  Plant = 30,  ///< grass tufts, reeds, rows of crops
  Stone = 31,
  Car = 32,
  Van = 33,
  Truck = 34,
  Bus = 35,
  Aircraft = 36,
  Helicopter = 37,
  Ship = 38,
  Boat = 39,
  Container = 40,
  Warehouse = 41,
  Hangar = 42,
  Pier = 43,
  Crane = 44,
  Pylon = 45,
  PowerLine = 46,
  WindTurbine = 47,
  StreetLamp = 48,
  Object = 49,  ///< any other thing
  Cloud = 50,
};
inline constexpr std::size_t kNumSemanticClasses = 51;

/// The classes' names, by number.
std::span<const std::string_view> semantic_class_names();

}  // namespace terracast::core
