#include "export/utc_stamps.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>

#include "geo/sun.h"

namespace terracast::exporters {

namespace {

constexpr std::int64_t kNanosecondsOfASecond = 1'000'000'000;

}  // namespace

std::int64_t unix_nanoseconds(const std::string& utc_start, double time_s) {
  constexpr std::size_t kSecondsEnd = 19;  // of "YYYY-MM-DDTHH:MM:SS"
  // Whole seconds are exact in a double; of the fraction each digit is taken as it stands.
  const std::int64_t start_s =
      std::llround(geo::unix_seconds_from_utc(utc_start.substr(0, kSecondsEnd) + "Z"));
  std::int64_t nanoseconds = std::llround(time_s * 1e9);
  std::int64_t digit_ns = 100'000'000;
  for (std::size_t i = kSecondsEnd + 1; i + 1 < utc_start.size(); ++i, digit_ns /= 10)
    nanoseconds += (utc_start[i] - '0') * digit_ns;
  return start_s * kNanosecondsOfASecond + nanoseconds;
}

std::string utc_with_nanoseconds(const std::string& utc_start, double time_s) {
  const std::chrono::sys_time<std::chrono::nanoseconds> instant{
      std::chrono::nanoseconds(unix_nanoseconds(utc_start, time_s))};
  const auto second = std::chrono::floor<std::chrono::seconds>(instant);  // also before the start
  const auto day = std::chrono::floor<std::chrono::days>(second);
  const std::chrono::year_month_day date{day};
  const std::chrono::hh_mm_ss time{second - day};
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02}.{:09}", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                     time.hours().count(), time.minutes().count(), time.seconds().count(),
                     (instant - second).count());
}

std::string seconds_with_nanoseconds(std::int64_t unix_ns) {
  const std::int64_t size_ns = std::abs(unix_ns);
  return fmt::format("{}{}.{:09}", unix_ns < 0 ? "-" : "", size_ns / kNanosecondsOfASecond,
                     size_ns % kNanosecondsOfASecond);
}

}  // namespace terracast::exporters
