#pragma once

#include <cstdint>
#include <string>

/// Instants as formats stamp them: whole nanoseconds, which a double of seconds since 1970 does not hold.
namespace terracast::exporters {

/// Nanoseconds since 1970-01-01T00:00:00Z of an instant of a sequence, by its start and the time since then, rounded.
/// utc_start   YYYY-MM-DDTHH:MM:SS[.fff]Z
std::int64_t unix_nanoseconds(const std::string& utc_start, double time_s);

/// "2011-09-26 13:02:25.964389445", nine decimals, of the same.
std::string utc_with_nanoseconds(const std::string& utc_start, double time_s);

/// "1316998945.964389445" of nanoseconds since 1970: seconds, nine decimals.
std::string seconds_with_nanoseconds(std::int64_t unix_ns);

}  // namespace terracast::exporters
