#include "geo/sun.h"

#include <cmath>
#include <cstdint>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

constexpr double kAstronomicalUnit_m = 149597870700.0;
constexpr double kUnixSecondsOfJ2000 = 946728000.0;  // 2000-01-01T12:00:00Z

/// Days from 1970-01-01 to a date of the Gregorian calendar, which is counted from 1 March so that
/// the leap day is the last of its year.
std::int64_t days_from_date(std::int64_t year, int month, int day) {
  const std::int64_t shifted_year = month > 2 ? year : year - 1;
  const int shifted_month = month > 2 ? month - 3 : month + 9;  // March is 0
  const std::int64_t day_of_year = (153 * shifted_month + 2) / 5 + day - 1;
  return shifted_year * 365 + shifted_year / 4 - shifted_year / 100 + shifted_year / 400 +
         day_of_year - 719468;
}

bool is_leap(int year) { return (year % 4 == 0 && year % 100 != 0) || year % 400 == 0; }

int days_of_month(int year, int month) {
  constexpr int kDays[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  return kDays[month - 1] + (month == 2 && is_leap(year) ? 1 : 0);
}

/// Reads exactly `count` digits at `at`; -1 when they are not digits.
int digits(const std::string& text, std::size_t at, std::size_t count) {
  int value = 0;
  for (std::size_t i = at; i < at + count; ++i) {
    if (text[i] < '0' || text[i] > '9') return -1;
    value = value * 10 + (text[i] - '0');
  }
  return value;
}

}  // namespace

double unix_seconds_from_utc(const std::string& utc) {
  constexpr std::size_t kSecondsEnd = 19;  // of "YYYY-MM-DDTHH:MM:SS"
  const auto refuse = [&](const char* why) {
    core::fail(core::ErrorKind::Config,
               "\"{}\" is not a UTC time: {}; write it like 2025-06-21T10:00:00Z or "
               "2025-06-21T10:00:00.250Z",
               utc, why);
  };
  if (utc.size() <= kSecondsEnd || utc.back() != 'Z' || utc[4] != '-' || utc[7] != '-' ||
      utc[10] != 'T' || utc[13] != ':' || utc[16] != ':') {
    refuse("its form is not YYYY-MM-DDTHH:MM:SSZ");
  }
  const int year = digits(utc, 0, 4);
  const int month = digits(utc, 5, 2);
  const int day = digits(utc, 8, 2);
  const int hour = digits(utc, 11, 2);
  const int minute = digits(utc, 14, 2);
  const int second = digits(utc, 17, 2);
  if (year < 0 || month < 0 || day < 0 || hour < 0 || minute < 0 || second < 0) {
    refuse("its form is not YYYY-MM-DDTHH:MM:SSZ");
  }
  double fraction_s = 0.0;
  if (utc.size() > kSecondsEnd + 1) {
    const std::size_t num_digits = utc.size() - kSecondsEnd - 2;
    if (utc[kSecondsEnd] != '.' || num_digits < 1 || num_digits > 9 ||
        digits(utc, kSecondsEnd + 1, num_digits) < 0) {
      refuse("a fraction of a second is a point and 1 to 9 digits");
    }
    fraction_s =
        digits(utc, kSecondsEnd + 1, num_digits) * std::pow(10.0, -static_cast<double>(num_digits));
  }
  if (month < 1 || month > 12) refuse("there is no such month");
  if (day < 1 || day > days_of_month(year, month)) refuse("the month has no such day");
  if (hour > 23 || minute > 59 || second > 59) {
    refuse("the time of day is outside 00:00:00 to 23:59:59 (leap seconds are not counted)");
  }
  const std::int64_t seconds =
      days_from_date(year, month, day) * 86400 + hour * 3600 + minute * 60 + second;
  return static_cast<double>(seconds) + fraction_s;
}

// Low-precision formulae for the Sun's coordinates, Astronomical Almanac, section C: mean equinox
// and equator of date, aberration included. UTC stands for UT1 (they differ by less than 0.9 s,
// 0.004 deg of hour angle) and for the argument in days (71 s, 0.0008 deg).
Eigen::Vector3d sun_direction_world(const WorldFrame& frame, const Geodetic& place,
                                    double unix_seconds) {
  const double days = (unix_seconds - kUnixSecondsOfJ2000) / 86400.0;
  const double mean_longitude_deg = 280.460 + 0.9856474 * days;
  const double anomaly = radians_from_degrees(357.528 + 0.9856003 * days);
  const double longitude = radians_from_degrees(mean_longitude_deg + 1.915 * std::sin(anomaly) +
                                                0.020 * std::sin(2.0 * anomaly));
  const double obliquity = radians_from_degrees(23.439 - 0.0000004 * days);
  const double distance_m = kAstronomicalUnit_m * (1.00014 - 0.01671 * std::cos(anomaly) -
                                                   0.00014 * std::cos(2.0 * anomaly));
  const Eigen::Vector3d sun_equatorial(std::cos(longitude),
                                       std::cos(obliquity) * std::sin(longitude),
                                       std::sin(obliquity) * std::sin(longitude));
  // Greenwich mean sidereal time; the whole turns are taken off first to keep the fraction's
  // digits.
  const double day_fraction = days - std::floor(days);
  const double sidereal_deg = 280.46061837 + 0.98564736629 * days + 360.0 * day_fraction;
  const double sidereal = radians_from_degrees(std::fmod(sidereal_deg, 360.0));
  const Eigen::Vector3d sun_ecef =
      distance_m * (Eigen::AngleAxisd(-sidereal, Eigen::Vector3d::UnitZ()) * sun_equatorial);
  // Seen from the place, not from the Earth's centre: up to 0.0024 deg.
  const Eigen::Vector3d sight_ecef = sun_ecef - ecef_from_geodetic(place);
  return (frame.ecef_from_world().rotation.conjugate() * sight_ecef).normalized();
}

}  // namespace terracast::geo
