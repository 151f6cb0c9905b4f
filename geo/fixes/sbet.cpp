#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "geo/fixes/binary.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/times.h"
#include "geo/gps_time.h"
#include "geo/sun.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kNumFields = 17;
constexpr std::size_t kRecordSize = kNumFields * sizeof(double);
constexpr std::array<std::string_view, kNumFields> kFields = {
    "time",         "latitude",       "longitude",      "altitude",       "x velocity",
    "y velocity",   "z velocity",     "roll",           "pitch",          "platform heading",
    "wander angle", "x acceleration", "y acceleration", "z acceleration", "x rate",
    "y rate",       "z rate"};

constexpr std::string_view kOfTheMotion = "follows from the places and attitudes that are flown";

constexpr std::array kKnown = {
    core::KnownName{"time", "GPS time in seconds of the week"},
    core::KnownName{"latitude", "latitude in radians"},
    core::KnownName{"longitude", "longitude in radians"},
    core::KnownName{"altitude", "height in metres"},
    core::KnownName{"x velocity", "speed, which the motion is compared with"},
    core::KnownName{"y velocity", "speed, which the motion is compared with"},
    core::KnownName{"roll", "attitude in radians, right side down"},
    core::KnownName{"pitch", "attitude in radians, nose up"},
    core::KnownName{"platform heading", "attitude in radians, clockwise from the wandering axis"},
    core::KnownName{"wander angle", "by how much the heading is more than the true one"},
    core::KnownName{"z velocity", kOfTheMotion, false},
    core::KnownName{"x acceleration", kOfTheMotion, false},
    core::KnownName{"y acceleration", kOfTheMotion, false},
    core::KnownName{"z acceleration", kOfTheMotion, false},
    core::KnownName{"x rate", kOfTheMotion, false},
    core::KnownName{"y rate", kOfTheMotion, false},
    core::KnownName{"z rate", kOfTheMotion, false}};
constexpr std::array kTables = {core::KnownTable{"sbet", "fields of a record", kKnown}};

constexpr double kWeek_s = 604800.0;

/// Trajectories of POSPac and its like: 17 doubles a record, about level axes that wander from north. The platform's
/// x axis lies the wander angle west of north, so that a true heading is the platform's less the wander angle.
class SbetFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key(
        "gps_date", gps_date_,
        "A day (2024-06-01) of the GPS week in which the record begins, which goes from Sunday "
        "to Saturday: its times are seconds of a week that it does not name. Empty: they "
        "count from any zero, and no UTC is known.");
    visit.key("time_in", time_in_,
              "What its times are: seconds of the GPS week, or seconds of the day gps_date.",
              core::one_of({"gps_week", "gps_day"}));
  }
  void validate() const override {
    if (!gps_date_.empty()) midnight_unix_s();
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<SbetFixes>(*this); }
  std::string heights_above() const override { return "ellipsoid"; }

  FixTable read(const std::filesystem::path& file, const std::string& above) const override {
    const std::vector<std::byte> bytes = bytes_of_recording(file);
    const std::size_t num_records = bytes.size() / kRecordSize;
    if (bytes.empty() || bytes.size() % kRecordSize != 0)
      fail(ErrorKind::Input,
           "{}: {} bytes; a record has {} (17 doubles), so that it is cut off at byte {}, or no "
           "SBET",
           file.string(), bytes.size(), kRecordSize, num_records * kRecordSize);
    if (num_records > kMostFixes)
      fail(ErrorKind::Input, "{}: {} records; up to {} are read: cut it", file.string(),
           num_records, kMostFixes);
    FixTable table;
    UnwrappedTime unwrapped(time_in_ == "gps_week" ? kWeek_s : 86400.0);
    for (std::size_t i = 0; i < num_records; ++i) {
      const std::string where = fmt::format("{}, record {} (counted from 0) at byte {}",
                                            file.string(), i, i * kRecordSize);
      const auto record = std::span(bytes).subspan(i * kRecordSize, kRecordSize);
      table.fixes.push_back(fix_of(record, above, where));
      Fix& fix = table.fixes.back();
      fix.time_s = unwrapped.next_s(fix.time_s);
    }
    // Its clock knows no leap seconds: those of its beginning hold for the whole record.
    const double first_s = table.fixes.front().time_s;
    if (!gps_date_.empty())
      table.zero_unix_s = unix_seconds_from_gps(zero_of_times_gps_s() + first_s) - first_s;
    for (const std::string_view field : kFields)
      if (field == kFields[Altitude] && above == "none")
        table.ledger.ignore(field, kNoHeightsWanted, static_cast<std::int64_t>(num_records));
      else
        table.ledger.count(field, kKnown, static_cast<std::int64_t>(num_records));
    if (!table.has_utc())
      table.remarks.push_back(
          "its times are of a week that it does not name; gps_date would say which, for UTC");
    return table;
  }

 private:
  enum Field : std::size_t {
    Time,
    Latitude,
    Longitude,
    Altitude,
    SpeedX,
    SpeedY,
    SpeedZ,
    Roll,
    Pitch,
    PlatformHeading,
    WanderAngle
  };

  static Fix fix_of(std::span<const std::byte> record, const std::string& above,
                    const std::string& where) {
    const auto value = [&](Field field) {
      const auto number = number_at<double>(record, field * sizeof(double));
      if (!std::isfinite(number))
        fail(ErrorKind::Input, "{}: {} is {}; a finite number is expected", where, kFields[field],
             number);
      return number;
    };
    constexpr double kMostTime_s = 1e9, kMostAngle = 2.0 * std::numbers::pi + 1e-6;
    const double time_s = value(Time), lat = value(Latitude), lon = value(Longitude);
    if (std::abs(lat) > 0.5 * std::numbers::pi || std::abs(lon) > kMostAngle ||
        std::abs(value(PlatformHeading)) > 2.0 * kMostAngle || time_s < 0.0 || time_s > kMostTime_s)
      fail(ErrorKind::Input,
           "{}: time {}, latitude {}, longitude {}, heading {}; they are seconds of a week, and "
           "radians (degrees are not), little-endian: is it an SBET?",
           where, time_s, lat, lon, value(PlatformHeading));
    Fix fix;
    fix.time_s = time_s;
    fix.place.head<2>() << degrees_from_radians(lat), degrees_from_radians(lon);
    if (above != "none") fix.place.z() = value(Altitude);
    fix.attitude = enu_from_body_by_ned_angles(value(PlatformHeading) - value(WanderAngle),
                                               value(Pitch), value(Roll));
    fix.speed_mps = std::hypot(value(SpeedX), value(SpeedY));
    return fix;
  }

  double midnight_unix_s() const { return unix_seconds_from_utc(gps_date_ + "T00:00:00Z"); }

  /// GPS time at which the file's times are 0, in seconds since 1980-01-06, a Sunday.
  double zero_of_times_gps_s() const {
    const double day_gps_s =
        gps_seconds_from_unix(midnight_unix_s()) - gps_minus_utc_s(midnight_unix_s());
    return time_in_ == "gps_week" ? std::floor(day_gps_s / kWeek_s) * kWeek_s : day_gps_s;
  }

  static double unix_seconds_from_gps(double gps_s) {
    constexpr double kEpoch_s = 315964800.0;
    const double without_leaps_s = gps_s + kEpoch_s;
    // The leap seconds of a second before are those of now, but within the seconds about a leap.
    return without_leaps_s - gps_minus_utc_s(without_leaps_s - gps_minus_utc_s(without_leaps_s));
  }

  std::string gps_date_;
  std::string time_in_ = "gps_week";
};

}  // namespace

FixFormatInfo sbet_fixes() {
  return {.name = "sbet",
          .summary = "Smoothed trajectories of POSPac (SBET): 17 doubles a record.",
          .make = [] { return std::unique_ptr<FixFormat>(new SbetFixes); },
          .known = kTables};
}

}  // namespace terracast::geo
