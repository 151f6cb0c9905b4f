#pragma once

#include <string>

#include "validate/causes/trial.h"

/// What an offset of all heights may come from.
namespace terracast::validate {

/// Heights above the geoid are off by less its undulation.
enum class HeightFault { Geoid, GeoidTwice, Datum, Other };
HeightFault height_fault(const Trial& trial, double off_m);

/// "heights are above the geoid where the ellipsoid is meant: 52.8 m too low".
/// about  "about " where the offset is not exact, or nothing
/// twice  what is said of heights to which the geoid's was added once too often
std::string words_of_heights(HeightFault fault, double off_m, const std::string& about,
                             const std::string& twice);

}  // namespace terracast::validate
