#pragma once

#include <optional>
#include <string_view>

namespace terracast::geo {

/// Degrees of a latitude or longitude as maps write it: degrees, and minutes and seconds where they are, each behind
/// its sign (°, ' and ", or d, m and s), a colon or a blank; then or before them a letter, or a minus. "46° 30' 12" N",
/// "W 7 12.5", "-13:44:50".
/// letters   of what is positive and of what is negative: "NS", "EW"
/// returns   nothing where the text is another, minutes or seconds are 60 or more, or a minus and a letter stand
std::optional<double> degrees_from_text(std::string_view text, std::string_view letters);

}  // namespace terracast::geo
