#pragma once

#include <cstdint>

#include "tiler/country/sites.h"

namespace terracast::tiler::country {

/// What a place of a settlement is built with.
enum class Zone : std::uint8_t { Center, Dense, Mixed, Slabs, Business, Industry, Houses };

/// far   how built-up the place is: TownShape::at
Zone zone_of(const Settlement& town, const Point& at, double far, std::uint64_t seed);

}  // namespace terracast::tiler::country
