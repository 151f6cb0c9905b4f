#include "geo/sun.h"

#include <cmath>
#include <cstdint>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

constexpr double kAstronomicalUnit_m = 149597870700.0;
constexpr double kAberration_deg = 0.00569;
/// In 2000; 29 s in 1950, about 80 s in 2050, while the Sun moves 0.0004 deg in the difference.
constexpr double kTerrestrialMinusUniversal_s = 64.0;
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

std::string utc_from_unix_seconds(double unix_seconds) {
  constexpr double kYear0000_s = -62167219200.0, kYear10000_s = 253402300800.0;
  const double rounded_ms = std::round(unix_seconds * 1000.0);
  if (!(rounded_ms >= kYear0000_s * 1000.0 && rounded_ms < kYear10000_s * 1000.0)) {
    core::fail(core::ErrorKind::Input,
               "{} s from 1970 is no time between the years 0000 and 9999; check the unit of the "
               "recorded times",
               unix_seconds);
  }
  const auto milliseconds = static_cast<std::int64_t>(rounded_ms);
  constexpr std::int64_t kDay_ms = 86400000;
  const std::int64_t of_day = ((milliseconds % kDay_ms) + kDay_ms) % kDay_ms;
  const std::int64_t day = (milliseconds - of_day) / kDay_ms;
  // The year is guessed from below and raised until its last day is reached.
  std::int64_t year =
      static_cast<std::int64_t>(std::floor(1970.0 + (static_cast<double>(day) - 2.0) / 365.2425));
  while (days_from_date(year + 1, 1, 1) <= day) ++year;
  int month = 1;
  while (month < 12 && days_from_date(year, month + 1, 1) <= day) ++month;
  const std::int64_t day_of_month = day - days_from_date(year, month, 1) + 1;
  const std::string whole =
      fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}", year, month, day_of_month,
                  of_day / 3600000, of_day / 60000 % 60, of_day / 1000 % 60);
  return of_day % 1000 == 0 ? whole + "Z" : fmt::format("{}.{:03}Z", whole, of_day % 1000);
}

// The Sun's apparent place by the lower-accuracy method of Meeus, Astronomical Algorithms (2nd
// ed.), chapter 25 (Kepler's ellipse, aberration, the nodal term of nutation), with the
// perturbations of his Astronomical Formulae for Calculators, chapter 18. At 30 000 times from 1950
// to 2050 it is within 0.0048 deg of ERFA's ephemeris; UTC in the place of UT1, from which it
// differs by less than 0.9 s, adds up to 0.0038 deg of hour angle.
Eigen::Vector3d sun_direction_world(const WorldFrame& frame, const Geodetic& place,
                                    double unix_seconds) {
  const double days = (unix_seconds - kUnixSecondsOfJ2000) / 86400.0;
  const double centuries = (days + kTerrestrialMinusUniversal_s / 86400.0) / 36525.0;
  const double mean_longitude_deg = 280.46646 + (36000.76983 + 0.0003032 * centuries) * centuries;
  const double anomaly_deg = 357.52911 + (35999.05029 - 0.0001537 * centuries) * centuries;
  const double anomaly = radians_from_degrees(std::fmod(anomaly_deg, 360.0));
  const double centre_deg = (1.914602 - 0.004817 * centuries) * std::sin(anomaly) +
                            (0.019993 - 0.000101 * centuries) * std::sin(2.0 * anomaly) +
                            0.000289 * std::sin(3.0 * anomaly);
  // Venus (twice), Jupiter, the Moon and a slow term of the planets; the arguments count from
  // 1899-12-31T12:00.
  const double since_1900 = centuries + 1.0;
  const auto swing_deg = [&](double amplitude_deg, double phase_deg, double rate_deg) {
    const double argument_deg = std::fmod(phase_deg + rate_deg * since_1900, 360.0);
    return amplitude_deg * std::cos(radians_from_degrees(argument_deg));
  };
  const double perturbation_deg =
      swing_deg(0.00134, 153.23, 22518.7541) + swing_deg(0.00154, 216.57, 45037.5082) +
      swing_deg(0.00200, 312.69, 32964.3577) + swing_deg(0.00179, 350.74 - 90.0, 445267.1142) +
      swing_deg(0.00178, 231.19 - 90.0, 20.20);
  const double node = radians_from_degrees(125.04 - 1934.136 * centuries);
  const double nutation_deg = -0.00478 * std::sin(node);
  const double longitude = radians_from_degrees(std::fmod(
      mean_longitude_deg + centre_deg + perturbation_deg - kAberration_deg + nutation_deg, 360.0));
  const double obliquity =
      radians_from_degrees(23.439291 - 0.0130042 * centuries + 0.00256 * std::cos(node));
  const double eccentricity = 0.016708634 - 0.000042037 * centuries;
  const double distance_m =
      kAstronomicalUnit_m * 1.000001018 * (1.0 - eccentricity * eccentricity) /
      (1.0 + eccentricity * std::cos(anomaly + radians_from_degrees(centre_deg)));
  const Eigen::Vector3d sun_equatorial(std::cos(longitude),
                                       std::cos(obliquity) * std::sin(longitude),
                                       std::sin(obliquity) * std::sin(longitude));
  // Greenwich sidereal time, apparent as the longitude is; whole turns are taken off first to keep
  // the fraction's digits.
  const double day_fraction = days - std::floor(days);
  const double sidereal_deg = 280.46061837 + 0.98564736629 * days + 360.0 * day_fraction +
                              nutation_deg * std::cos(obliquity);
  const double sidereal = radians_from_degrees(std::fmod(sidereal_deg, 360.0));
  const Eigen::Vector3d sun_ecef =
      distance_m * (Eigen::AngleAxisd(-sidereal, Eigen::Vector3d::UnitZ()) * sun_equatorial);
  // Seen from the place, not from the Earth's centre: up to 0.0024 deg.
  const Eigen::Vector3d sight_ecef = sun_ecef - ecef_from_geodetic(place);
  return (frame.ecef_from_world().rotation.conjugate() * sight_ecef).normalized();
}

}  // namespace terracast::geo
