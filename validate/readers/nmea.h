#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// Fixes of NMEA 0183 as our datasets have them: RMC, GGA and GST of each, in this order.
namespace terracast::validate {

struct NmeaFix {
  std::int64_t unix_ns = 0;  ///< UTC
  double lat_deg = 0.0, lon_deg = 0.0, altitude_msl_m = 0.0, undulation_m = 0.0;
  int kind = 0;     ///< of GGA
  char mode = 'N';  ///< of RMC
  double speed_mps = 0.0, course_deg = 0.0;
  double sigma_lat_m = 0.0, sigma_lon_m = 0.0, sigma_height_m = 0.0;
};

/// century  of the fixes' years, of which a sentence has two digits: 20
/// throws   Input: another form, a wrong checksum, sentences of one fix that contradict each other; `where` names the file
std::vector<NmeaFix> parse_nmea(std::string_view text, int century, const std::string& where);

}  // namespace terracast::validate
