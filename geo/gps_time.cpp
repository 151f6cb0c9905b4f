#include "geo/gps_time.h"

#include <array>

namespace terracast::geo {
namespace {

/// Beginnings of years and halves of years with another leap second, seconds since 1970.
constexpr std::array<double, 18> kLeaps = {
    362793600.0, 394329600.0,  425865600.0,  489024000.0,  567993600.0,  631152000.0,
    662688000.0, 709948800.0,  741484800.0,  773020800.0,  820454400.0,  867715200.0,
    915148800.0, 1136073600.0, 1230768000.0, 1341100800.0, 1435708800.0, 1483228800.0};

}  // namespace

double gps_minus_utc_s(double unix_s) {
  double leaps_s = 0.0;
  for (const double leap_s : kLeaps)
    if (unix_s >= leap_s) leaps_s += 1.0;
  return leaps_s;
}

double gps_seconds_from_unix(double unix_s) {
  constexpr double kEpoch_s = 315964800.0;  // 1980-01-06
  return unix_s - kEpoch_s + gps_minus_utc_s(unix_s);
}

}  // namespace terracast::geo
