#include "validate/causes/height_fault.h"

#include <fmt/format.h>

#include <cmath>

namespace terracast::validate {

HeightFault height_fault(const Trial& trial, double off_m) {
  // EGM96, EGM2008 and the data of countries lie within 2 m of each other nearly everywhere. A few
  // metres are too often something else.
  constexpr double kTolerance_m = 2.0;
  constexpr double kLeast_m = 5.0;
  if (std::abs(off_m) > kLeast_m && trial.undulation_m) {
    const Geodetic& place = trial.sequence.origin;
    const std::optional<double> undulation_m = trial.undulation_m(place.lat_deg, place.lon_deg);
    if (undulation_m && std::abs(off_m + *undulation_m) < kTolerance_m) return HeightFault::Geoid;
    if (undulation_m && std::abs(off_m - *undulation_m) < kTolerance_m)
      return HeightFault::GeoidTwice;
  }
  // Vertical data lie decimetres (one geoid and another) to a hundred metres (a geoid and the
  // ellipsoid) apart.
  return std::abs(off_m) > 0.1 && std::abs(off_m) < 110.0 ? HeightFault::Datum : HeightFault::Other;
}

std::string words_of_heights(HeightFault fault, double off_m, const std::string& about,
                             const std::string& twice) {
  const char* side = off_m < 0.0 ? "low" : "high";
  if (fault == HeightFault::Geoid)
    return fmt::format(
        "heights are above the geoid where the ellipsoid is meant: {}{:.1f} m too {}", about,
        std::abs(off_m), side);
  const std::string why = fault == HeightFault::GeoidTwice ? ": " + twice
                          : fault == HeightFault::Datum    ? ": above another datum?"
                                                           : "";
  return fmt::format("heights are {}{:.4g} m too {}{}", about, std::abs(off_m), side, why);
}

}  // namespace terracast::validate
