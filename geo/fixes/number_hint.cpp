#include "geo/fixes/number_hint.h"

#include <fmt/format.h>

#include <algorithm>

#include "geo/fixes/angles.h"
#include "geo/fixes/text.h"

namespace terracast::geo {

bool is_number_with_comma(std::string_view text) {
  if (std::count(text.begin(), text.end(), ',') != 1) return false;
  std::string point(text);
  std::replace(point.begin(), point.end(), ',', '.');
  return number_of(point).has_value();
}

bool is_angle_text(std::string_view text) {
  return degrees_from_text(text, "NS").has_value() || degrees_from_text(text, "EW").has_value();
}

std::string number_hint(std::string_view text, std::string_view way_out) {
  if (is_number_with_comma(text)) return fmt::format(" (with a decimal comma); {}", way_out);
  if (is_angle_text(text)) return fmt::format(" (but degrees and minutes); {}", way_out);
  return "";
}

}  // namespace terracast::geo
