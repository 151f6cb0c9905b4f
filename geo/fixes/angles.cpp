#include "geo/fixes/angles.h"

#include <algorithm>
#include <array>

#include "geo/fixes/text.h"

namespace terracast::geo {
namespace {

/// 0: the letter of what is positive, 1: of what is negative; cut off the front or the end.
std::optional<std::size_t> cut_letter(std::string_view& text, std::string_view letters) {
  for (std::size_t i = 0; i < letters.size() && !text.empty(); ++i) {
    if (text.front() == letters[i]) {
      text = trimmed(text.substr(1));
      return i;
    }
    if (text.back() == letters[i]) {
      text = trimmed(text.substr(0, text.size() - 1));
      return i;
    }
  }
  return std::nullopt;
}

/// Cuts the sign behind degrees (0), minutes (1) or seconds (2) off the front.
void cut_sign(std::string_view& text, std::size_t part) {
  constexpr std::array<std::array<std::string_view, 6>, 3> kSigns = {
      {{"\u00B0", "\u00BA", "\u02DA", "d", "deg", ":"},
       {"'", "\u2032", "\u2019", "m", "min", ":"},
       {"\"", "\u2033", "\u201D", "''", "sec", "s"}}};
  text = trimmed(text);
  std::size_t longest = 0;
  for (const std::string_view sign : kSigns[part])
    if (text.starts_with(sign)) longest = std::max(longest, sign.size());
  text = trimmed(text.substr(longest));
}

}  // namespace

std::optional<double> degrees_from_text(std::string_view text, std::string_view letters) {
  std::string_view rest = trimmed(text);
  const auto letter = cut_letter(rest, letters);
  const bool is_minus = rest.starts_with('-');
  if (is_minus) rest.remove_prefix(1);
  if ((is_minus && letter) || rest.empty()) return std::nullopt;
  double degrees = 0.0, unit = 1.0;
  bool has_fraction = false;
  for (std::size_t part = 0; part < 3 && !rest.empty(); ++part) {
    const std::size_t end = std::min(rest.find_first_not_of("0123456789."), rest.size());
    const std::string_view digits = rest.substr(0, end);
    const auto value = number_of(digits);
    // What is in minutes too has whole degrees.
    if (!value || has_fraction || (part > 0 && *value >= 60.0)) return std::nullopt;
    has_fraction = digits.find('.') != std::string_view::npos;
    degrees += *value * unit;
    unit /= 60.0;
    rest.remove_prefix(end);
    cut_sign(rest, part);
  }
  if (!rest.empty()) return std::nullopt;
  return is_minus || letter == 1u ? -degrees : degrees;
}

}  // namespace terracast::geo
