#include "geo/fixes/times.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/error.h"
#include "geo/fixes/text.h"
#include "geo/sun.h"

namespace terracast::geo {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes what a time consists of off the front of a text.
class TimeScanner {
 public:
  explicit TimeScanner(std::string_view text) : rest_(text) {}

  std::string_view rest() const { return rest_; }
  bool is_at_end() const { return rest_.empty(); }

  /// A number of so many digits.
  std::optional<int> digits(std::size_t fewest, std::size_t most) {
    std::size_t count = 0;
    int value = 0;
    while (count < most && count < rest_.size() && is_digit(rest_[count]))
      value = 10 * value + (rest_[count++] - '0');
    if (count < fewest) return std::nullopt;
    rest_.remove_prefix(count);
    return value;
  }
  bool take(std::string_view text) {
    if (!rest_.starts_with(text)) return false;
    rest_.remove_prefix(text.size());
    return true;
  }
  /// One of several letters; 0: none of them.
  char take_one_of(std::string_view letters) {
    if (rest_.empty() || letters.find(rest_[0]) == std::string_view::npos) return 0;
    const char c = rest_[0];
    rest_.remove_prefix(1);
    return c;
  }
  bool take_blanks() {
    const std::size_t size = rest_.size();
    while (take_one_of(" \t")) {
    }
    return rest_.size() < size;
  }

 private:
  std::string_view rest_;
};

/// YYYY-MM-DD or YYYYMMDD, as the former.
std::optional<std::string> date_of(TimeScanner& scanner) {
  const auto year = scanner.digits(4, 4);
  if (!year) return std::nullopt;
  const char between = scanner.take_one_of("-./");
  const std::size_t fewest = between ? 1 : 2;
  const auto month = scanner.digits(fewest, 2);
  if (!month || (between && !scanner.take(std::string_view(&between, 1)))) return std::nullopt;
  const auto day = scanner.digits(fewest, 2);
  if (!day) return std::nullopt;
  return fmt::format("{:04}-{:02}-{:02}", *year, *month, *day);
}

/// A fraction of a second behind its sign, in which commas may stand between groups of digits.
std::optional<double> fraction_of(TimeScanner& scanner) {
  if (!scanner.take_one_of(".,")) return 0.0;
  std::string digits;
  while (!scanner.is_at_end() && (is_digit(scanner.rest()[0]) || scanner.rest()[0] == ',')) {
    const char c = scanner.take_one_of("0123456789,");
    if (c != ',') digits += c;
  }
  if (digits.empty()) return std::nullopt;
  return number_of("0." + digits);
}

struct TimeOfDay {
  std::string text;  ///< HH:MM:SS
  double more_s = 0.0;
};

std::optional<TimeOfDay> time_of_day_of(TimeScanner& scanner, bool is_basic) {
  const std::size_t fewest = is_basic ? 2 : 1;
  const auto hour = scanner.digits(fewest, 2);
  if (!hour || (!is_basic && !scanner.take(":"))) return std::nullopt;
  const auto minute = scanner.digits(2, 2);
  if (!minute || (!is_basic && !scanner.take(":"))) return std::nullopt;
  const auto second = scanner.digits(2, 2);
  if (!second) return std::nullopt;
  const auto fraction = fraction_of(scanner);
  if (!fraction) return std::nullopt;
  const bool is_leap = *second == 60;
  return TimeOfDay{.text = fmt::format("{:02}:{:02}:{:02}", *hour, *minute, is_leap ? 59 : *second),
                   .more_s = *fraction + (is_leap ? 1.0 : 0.0)};
}

/// Seconds that the clock is ahead of UTC, by what stands at the end of the text.
std::optional<double> zone_of(TimeScanner& scanner) {
  scanner.take_blanks();
  for (const std::string_view name : {"Z", "z", "UTC", "GMT"})
    if (scanner.take(name)) return 0.0;
  const char sign = scanner.take_one_of("+-");
  const auto hours = sign ? scanner.digits(2, 2) : std::nullopt;
  if (!hours) return std::nullopt;
  int minutes = 0;
  if (!scanner.is_at_end()) {
    scanner.take(":");
    const auto stated = scanner.digits(2, 2);
    if (!stated) return std::nullopt;
    minutes = *stated;
  }
  constexpr int kMostHours = 14, kMinutes = 60;
  if (*hours > kMostHours || minutes >= kMinutes) return std::nullopt;
  const double ahead_s = *hours * 3600.0 + minutes * 60.0;
  return sign == '-' ? -ahead_s : ahead_s;
}

}  // namespace

std::optional<StatedTime> stated_time(std::string_view text, double utc_offset_h) {
  TimeScanner scanner(trimmed(text));
  const bool is_basic_date = scanner.rest().find_first_of("-./") != 4;
  const auto date = date_of(scanner);
  if (!date) return std::nullopt;
  const bool has_letter = scanner.take_one_of("Tt") != 0;
  if (!has_letter && !scanner.take_blanks()) return std::nullopt;
  const auto time = time_of_day_of(scanner, is_basic_date && scanner.rest().find(':') != 2);
  if (!time) return std::nullopt;
  double ahead_s = utc_offset_h * 3600.0;
  const bool has_zone = !scanner.is_at_end();
  if (has_zone) {
    const auto stated = zone_of(scanner);
    if (!stated || !scanner.is_at_end()) return std::nullopt;
    ahead_s = *stated;
  }
  try {
    const double whole_s = unix_seconds_from_utc(*date + "T" + time->text + "Z");
    // Zones are ahead by whole minutes, but utc_offset_h is any number.
    const double whole_ahead_s = std::trunc(ahead_s);
    return StatedTime{.unix_s = whole_s + time->more_s - ahead_s,
                      .has_zone = has_zone,
                      .exact = {.whole_s = whole_s - whole_ahead_s,
                                .rest_s = time->more_s - (ahead_s - whole_ahead_s)}};
  } catch (const core::Error&) {
    return std::nullopt;
  }
}

double unix_seconds_from_text(std::string_view text, double utc_offset_h,
                              const std::string& where) {
  if (const auto time = stated_time(text, utc_offset_h)) return time->unix_s;
  core::fail(core::ErrorKind::Input,
             "{}: \"{}\" is no time; one like 2025-06-21T10:00:00.250Z is expected", where,
             text.substr(0, 80));
}

std::optional<double> seconds_of_clock(std::string_view text) {
  constexpr std::size_t kMostDigits = 6;  // of hours: a century
  TimeScanner scanner(trimmed(text));
  const auto hours = scanner.digits(1, kMostDigits);
  if (!hours || !scanner.take(":")) return std::nullopt;
  const auto minutes = scanner.digits(2, 2);
  if (!minutes || !scanner.take(":")) return std::nullopt;
  const auto seconds = scanner.digits(2, 2);
  if (!seconds) return std::nullopt;
  const auto fraction = fraction_of(scanner);
  if (!fraction || !scanner.is_at_end()) return std::nullopt;
  return *hours * 3600.0 + *minutes * 60.0 + *seconds + *fraction;
}

double UnwrappedTime::next_s(double time_s) {
  if (wraps_s_ <= 0.0) return time_s;
  double unwrapped_s = time_s + static_cast<double>(num_wraps_) * wraps_s_;
  if (has_last_ && unwrapped_s < last_s_ - 0.5 * wraps_s_) {
    unwrapped_s += wraps_s_;
    ++num_wraps_;
  } else if (num_wraps_ > 0 && unwrapped_s > last_s_ + 0.5 * wraps_s_) {
    return unwrapped_s - wraps_s_;  // a row out of order, from before
  }
  has_last_ = true;
  last_s_ = unwrapped_s;
  return unwrapped_s;
}

std::string_view unit_of_unix_time(double number) {
  struct Unit {
    std::string_view name;
    double seconds;
  };
  constexpr std::array kUnits = {Unit{"s", 1.0}, Unit{"ms", 1e-3}, Unit{"us", 1e-6},
                                 Unit{"ns", 1e-9}};
  constexpr double kYear2001_s = 978307200.0, kYear2100_s = 4102444800.0;
  for (const Unit& unit : kUnits)
    if (number * unit.seconds >= kYear2001_s && number * unit.seconds < kYear2100_s)
      return unit.name;
  return "";
}

bool is_unix_time(double unix_s) {
  constexpr double kYear1900_s = -2208988800.0, kYear2200_s = 7258118400.0;
  return unix_s >= kYear1900_s && unix_s < kYear2200_s;
}

}  // namespace terracast::geo
