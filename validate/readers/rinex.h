#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "validate/gps_orbit.h"

/// RINEX 3 as our datasets have it: observations C1C, L1C and D1C of GPS, and GPS's navigation records.
namespace terracast::validate {

struct RinexObservation {
  int prn = 0;
  double pseudorange_m = 0.0, carrier_cycles = 0.0, doppler_hz = 0.0;
  bool is_new = false;  ///< it was lost before: bit 0 of the carrier's indicator
};

struct RinexEpoch {
  std::int64_t gps_steps = 0;  ///< of 100 ns since 1980-01-06, by the receiver's clock
  std::vector<RinexObservation> satellites;
};

struct RinexNavigation {
  std::array<double, 4> alpha{}, beta{};  ///< of Klobuchar's model
  std::vector<NavigationRecord> records;
};

/// throws   Input: another form; `where` names the file
std::vector<RinexEpoch> parse_rinex_observations(std::string_view text, const std::string& where);
RinexNavigation parse_rinex_navigation(std::string_view text, const std::string& where);

}  // namespace terracast::validate
