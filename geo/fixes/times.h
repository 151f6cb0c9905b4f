#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "geo/fixes/exact_time.h"

namespace terracast::geo {

/// A date and time of day that a file states.
struct StatedTime {
  double unix_s = 0.0;    ///< since 1970-01-01T00:00:00Z
  bool has_zone = false;  ///< it says how far its clock is ahead of UTC
  ExactTime exact;        ///< the same, not rounded
};

/// A date and time of day: YYYY-MM-DD (with - or . or / between; a month or day of one digit) or YYYYMMDD, then T or
/// blanks, HH:MM:SS (or HHMMSS), a fraction after a point or comma (DJI's "58,720,764" too), and Z, UTC, GMT, +HH,
/// +HH:MM or -HHMM. Without the latter the clock is utc_offset_h ahead of UTC. Second 60 is the next minute's first.
/// Nothing where the text is another.
std::optional<StatedTime> stated_time(std::string_view text, double utc_offset_h);

/// The same, which has to be one.
/// throws   Input: another form; `where` names the place
double unix_seconds_from_text(std::string_view text, double utc_offset_h, const std::string& where);

/// Seconds since midnight of HH:MM:SS with or without a fraction after a point or comma. Hours may be of any number
/// of digits, as in subtitles.
std::optional<double> seconds_of_clock(std::string_view text);

/// Times that start over: at midnight, at the end of a GPS week.
class UnwrappedTime {
 public:
  /// wraps_s   the time at which they start over; 0: they do not
  explicit UnwrappedTime(double wraps_s) : wraps_s_(wraps_s) {}
  /// A time that is earlier than the one before by more than half of wraps_s has started over.
  double next_s(double time_s);
  std::size_t num_wraps() const { return num_wraps_; }

 private:
  double wraps_s_;
  double last_s_ = 0.0;
  bool has_last_ = false;
  std::size_t num_wraps_ = 0;
};

/// Whether seconds since 1970 are of a time from 1900 to 2200.
bool is_unix_time(double unix_s);

/// The unit (s, ms, us, ns) in which a number counts from 1970 to a time between 2001 and 2100; empty: in none.
std::string_view unit_of_unix_time(double number);

}  // namespace terracast::geo
