#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::geo {

/// Without blanks, tabs and line ends on both sides.
std::string_view trimmed(std::string_view text);

/// A finite decimal number that is the whole text but for blanks on both sides; the decimal sign is a
/// point whatever the locale.
std::optional<double> number_of(std::string_view text);

/// The words between blanks.
std::vector<std::string_view> words_of(std::string_view line);

/// The lines of a text, without \n or \r\n; a last line that is empty is none.
std::vector<std::string_view> lines_of_text(std::string_view text);

/// Seconds since 1970-01-01T00:00:00Z of a date and time of day: YYYY-MM-DD or YYYY.MM.DD, then T or a
/// blank, HH:MM:SS, a fraction after a point or comma (DJI's "58,720,764" too), and Z, +HH:MM or -HH:MM.
/// Without the latter the clock is utc_offset_h ahead of UTC.
/// throws   Input: another form; `where` names the place
double unix_seconds_from_text(std::string_view text, double utc_offset_h, const std::string& where);

}  // namespace terracast::geo
