#pragma once

#include <cstdint>

#include "tiler/country/sites.h"
#include "tiler/country/survey.h"

namespace terracast::tiler::country {

enum class HouseKind : std::uint8_t {
  Detached,
  SemiDetached,
  Terrace,
  OldTown,
  Apartments,
  Slab,
  Office,
  Tower,
  Retail,
  Industrial,
  Warehouse,
  Church,
  School,
  Civic,
  FarmHouse,
  Barn,
  Shed,
  Hotel
};

/// Tags of a building of a kind, drawn from the country's manner, its settlement's palette and a number.
/// width_m   of its narrower side, which sets what roofs are plausible
Tags building_tags(HouseKind kind, BuildingManner manner, int palette, double width_m,
                   std::uint64_t draw);

}  // namespace terracast::tiler::country
