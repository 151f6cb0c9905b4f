#include "tiler/tag_values.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terracast::tiler {
namespace {

/// No number with its unit is longer.
constexpr std::size_t kMostBytes = 80;
constexpr double kMetresPerInch = 0.0254;
constexpr double kMetresPerFoot = 0.3048;
constexpr char kDegree = '\x01';  ///< in place of its sign

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Typographic signs as the typewriter has them, lower case, without blanks at both ends.
std::string plain_text(std::string_view text) {
  static constexpr std::pair<std::string_view, std::string_view> kSigns[] = {{"\xC2\xA0", " "},
                                                                             {"\xE2\x80\x89", " "},
                                                                             {"\xE2\x80\xAF", " "},
                                                                             {"\t", " "},
                                                                             {"\xE2\x80\xB2", "'"},
                                                                             {"\xE2\x80\x99", "'"},
                                                                             {"\xE2\x80\x98", "'"},
                                                                             {"\xC2\xB4", "'"},
                                                                             {"`", "'"},
                                                                             {"\xE2\x80\xB3", "\""},
                                                                             {"\xE2\x80\x9D", "\""},
                                                                             {"\xE2\x80\x9C", "\""},
                                                                             {"''", "\""},
                                                                             {"\xE2\x80\x93", "-"},
                                                                             {"\xE2\x80\x94", "-"},
                                                                             {"\xE2\x80\x91", "-"},
                                                                             {"\xE2\x88\x92", "-"},
                                                                             {"\xE2\x89\x88", "~"},
                                                                             {"\xC2\xB0", "\x01"},
                                                                             {"\xC2\xBA", "\x01"},
                                                                             {"\xC2\xBD", ".5"}};
  std::string plain(text);
  const bool has_signs = plain.find("''") != std::string::npos ||
                         std::any_of(plain.begin(), plain.end(),
                                     [](char c) { return c < ' ' || c > '~' || c == '`'; });
  if (has_signs)
    for (const auto& [sign, with] : kSigns)
      for (std::size_t at = plain.find(sign); at != std::string::npos;
           at = plain.find(sign, at + with.size()))
        plain.replace(at, sign.size(), with);
  for (char& c : plain)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  const std::size_t first = plain.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return plain.substr(first, plain.find_last_not_of(' ') + 1 - first);
}

void skip_blanks(std::string_view& rest) {
  while (!rest.empty() && rest.front() == ' ') rest.remove_prefix(1);
}

bool skip(std::string_view& rest, std::string_view what) {
  if (!rest.starts_with(what)) return false;
  rest.remove_prefix(what.size());
  return true;
}

/// Letters.
std::string_view take_word(std::string_view& rest) {
  std::size_t size = 0;
  while (size < rest.size() && rest[size] >= 'a' && rest[size] <= 'z') ++size;
  const std::string_view word = rest.substr(0, size);
  rest.remove_prefix(size);
  return word;
}

/// Whether signs part digits into groups of three, but for the first, which may be shorter.
bool groups_by_three(std::string_view digits, char sign) {
  std::size_t size = 0;
  bool is_first = true;
  for (const char c : digits) {
    if (c != sign) {
      ++size;
      continue;
    }
    if (is_first ? size < 1 || size > 3 : size != 3) return false;
    is_first = false;
    size = 0;
  }
  return is_first || size == 3;
}

/// Digits with their signs, as from_chars() reads them; "": they are no number.
std::string decimal_digits(std::string_view token) {
  const auto number_of = [&](char c) { return std::count(token.begin(), token.end(), c); };
  const auto dots = number_of('.');
  const auto commas = number_of(',');
  char decimal = 0;
  if (dots > 0 && commas > 0)
    decimal = token.rfind('.') > token.rfind(',') ? '.' : ',';
  else if (dots == 1 || commas == 1)
    decimal = dots == 1 ? '.' : ',';
  std::string_view whole = token;
  std::string_view part;
  if (decimal != 0) {
    const std::size_t at = token.rfind(decimal);
    whole = token.substr(0, at);
    part = token.substr(at + 1);
    if (whole.find(decimal) != std::string_view::npos) return "";
  }
  // "1,250" may be either.
  if (decimal == ',' && dots == 0 && part.size() == 3 && !whole.empty() && whole.size() <= 3 &&
      whole.front() != '0')
    return "";
  char grouping = 0;
  for (const char sign : {'.', ',', ' ', '\''}) {
    if (whole.find(sign) == std::string_view::npos) continue;
    if (grouping != 0 || !groups_by_three(whole, sign)) return "";
    grouping = sign;
  }
  std::string digits;
  for (const char c : whole)
    if (is_digit(c)) digits += c;
  if (digits.empty()) digits = "0";
  if (part.find_first_of(" '") != std::string_view::npos) return "";
  return part.empty() ? digits : digits + "." + std::string(part);
}

/// How many characters of a text are a number without its sign, with its groups and decimals.
std::size_t size_of_digits(std::string_view text) {
  std::size_t size = 0;
  while (size < text.size()) {
    const char c = text[size];
    const bool digit_follows = size + 1 < text.size() && is_digit(text[size + 1]);
    if (is_digit(c) || ((c == '.' || c == ',') && digit_follows)) {
      ++size;
      continue;
    }
    // A blank or an apostrophe before three digits and no more groups digits: no inches have three.
    const bool groups = (c == ' ' || c == '\'') && size > 0 && size + 3 < text.size() &&
                        digit_follows && is_digit(text[size + 2]) && is_digit(text[size + 3]) &&
                        (size + 4 == text.size() || !is_digit(text[size + 4]));
    if (!groups) break;
    ++size;
  }
  return size;
}

/// The dot after a whole number that ends a sentence, and is neither decimal nor half of "..".
void skip_full_stop(std::string_view digits, std::string_view& rest) {
  if (!std::all_of(digits.begin(), digits.end(), is_digit)) return;
  if (rest == "." || (rest.starts_with(".") && (rest[1] == ' ' || rest[1] == ';')))
    rest.remove_prefix(1);
}

std::optional<double> take_number(std::string_view& rest) {
  std::string_view left = rest;
  const bool is_negative = skip(left, "-");
  if (!is_negative) skip(left, "+");
  const std::size_t size = size_of_digits(left);
  std::string digits = decimal_digits(left.substr(0, size));
  if (size == 0 || digits.empty()) return std::nullopt;
  left.remove_prefix(size);
  skip_full_stop(digits, left);
  // As programs write the very large and the very small.
  if (left.size() >= 2 && left[0] == 'e') {
    const std::size_t first = left[1] == '-' || left[1] == '+' ? 2 : 1;
    std::size_t end = first;
    while (end < left.size() && is_digit(left[end])) ++end;
    if (end > first) {
      digits += left[1] == '+' ? "e" + std::string(left.substr(2, end - 2))
                               : std::string(left.substr(0, end));
      left.remove_prefix(end);
    }
  }
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value))
    return std::nullopt;
  rest = left;
  return is_negative ? -value : value;
}

/// A number in a unit, or in that of others of its range or list.
struct Measure {
  double value = 0.0;
  double unit = 0.0;  ///< 0: none stands there
};

struct Unit {
  std::string_view names;
  double value;
};
constexpr Unit kLengths[] = {{"m|meter|meters|metre|metres", 1.0},
                             {"mm|millimeter|millimeters|millimetre|millimetres", 0.001},
                             {"cm|centimeter|centimeters|centimetre|centimetres", 0.01},
                             {"dm", 0.1},
                             {"km|kilometer|kilometers|kilometre|kilometres", 1000.0},
                             {"ft|feet|foot", kMetresPerFoot},
                             {"in|inch|inches", kMetresPerInch},
                             {"yd|yds|yard|yards", 0.9144},
                             {"mi|mile|miles", 1609.344},
                             {"nmi", 1852.0}};

/// Its size; 0: there is no unit. Nothing is taken then.
double take_unit(std::string_view& rest, std::span<const Unit> units) {
  std::string_view left = rest;
  skip_blanks(left);
  const std::string_view word = take_word(left);
  if (word.empty()) return 0.0;
  for (const Unit& unit : units)
    if (is_one_of(word, unit.names)) {
      skip(left, ".");
      rest = left;
      return unit.value;
    }
  return 0.0;
}

/// The inches after feet; 0: there are none.
/// by_mark   whether feet had an apostrophe, after which inches need no sign: 40'6
double take_inches(std::string_view& rest, bool by_mark) {
  std::string_view left = rest;
  skip_blanks(left);
  const bool has_dash = skip(left, "-");
  if (left.empty() || !(is_digit(left.front()) || left.front() == '.')) return 0.0;
  const std::optional<double> inches = take_number(left);
  if (!inches || *inches >= 12.0) return 0.0;
  std::string_view after = left;
  skip_blanks(after);
  const bool has_sign = skip(after, "\"") || take_unit(after, kLengths) == kMetresPerInch;
  if (!has_sign && (!by_mark || has_dash || !left.empty())) return 0.0;
  rest = has_sign ? after : left;
  return *inches;
}

std::optional<Measure> take_length(std::string_view& rest) {
  const std::string_view text = rest;
  const std::optional<double> value = take_number(rest);
  if (!value) return std::nullopt;
  const bool has_apostrophe =
      text.substr(0, text.size() - rest.size()).find('\'') != std::string_view::npos;
  std::string_view after = rest;
  skip_blanks(after);
  const bool is_feet_mark = skip(after, "'");
  const bool is_inch_mark = !is_feet_mark && skip(after, "\"");
  if (is_feet_mark || is_inch_mark) rest = after;
  const double unit = is_feet_mark   ? kMetresPerFoot
                      : is_inch_mark ? kMetresPerInch
                                     : take_unit(rest, kLengths);
  // 1'250" may be feet and inches gone wrong.
  if (has_apostrophe && (unit == kMetresPerFoot || unit == kMetresPerInch)) return std::nullopt;
  if (unit != kMetresPerFoot) return Measure{*value, unit};
  return Measure{*value + std::copysign(take_inches(rest, is_feet_mark) / 12.0, *value), unit};
}

/// "~", "ca.": as uncertain as it is, it is the best that is known.
void skip_uncertainty(std::string_view& rest) {
  for (const std::string_view word :
       {"~", "approximately", "approx.", "approx", "about", "circa", "ca.", "ca", "c."})
    if (skip(rest, word)) break;
  skip_blanks(rest);
}

/// A number, or both ends of a range, of which one may have the unit of both. False: there is none.
template <class Take>
bool take_range(std::string_view rest, const Take& take, std::vector<Measure>& measures) {
  skip_blanks(rest);
  skip_uncertainty(rest);
  std::optional<Measure> from = take(rest);
  if (!from) return false;
  skip_blanks(rest);
  std::optional<Measure> to = from;
  if (skip(rest, "-") || skip(rest, "..")) {
    skip_blanks(rest);
    to = take(rest);
    if (!to) return false;
    skip_blanks(rest);
  }
  if (!rest.empty()) return false;
  if (from->unit == 0.0) from->unit = to->unit;
  if (to->unit == 0.0) to->unit = from->unit;
  measures.insert(measures.end(), {*from, *to});
  return true;
}

/// From the least to the most; what has no unit has that of the next one that has any.
Amount amount_of(const std::vector<Measure>& measures) {
  Amount amount{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  double unit = 0.0;
  for (std::size_t i = measures.size(); i-- > 0;) {
    if (measures[i].unit != 0.0) unit = measures[i].unit;
    const double size = measures[i].value * (unit == 0.0 ? 1.0 : unit);
    amount = {std::min(amount.lowest, size), std::max(amount.highest, size)};
  }
  return amount;
}

/// Ranges that one of some signs parts.
template <class Take>
std::optional<Amount> amount_of(std::string_view text, std::string_view partings,
                                const Take& take) {
  if (text.size() > kMostBytes) return std::nullopt;
  const std::string plain = plain_text(text);
  std::string_view rest = plain;
  std::vector<Measure> measures;
  while (true) {
    const std::size_t end = std::min(rest.find_first_of(partings), rest.size());
    if (!take_range(rest.substr(0, end), take, measures)) return std::nullopt;
    if (end == rest.size()) return amount_of(measures);
    rest.remove_prefix(end + 1);
  }
}

auto taker_of(std::span<const Unit> units) {
  return [units](std::string_view& rest) -> std::optional<Measure> {
    const std::optional<double> value = take_number(rest);
    if (!value) return std::nullopt;
    return Measure{*value, take_unit(rest, units)};
  };
}

/// Degrees, with or without their sign; the unit is 1.
std::optional<Measure> take_degrees(std::string_view& rest) {
  static constexpr Unit kDegrees[] = {{"deg|degree|degrees", 1.0}};
  const std::optional<double> value = take_number(rest);
  if (!value) return std::nullopt;
  std::string_view after = rest;
  skip_blanks(after);
  if (skip(after, std::string_view(&kDegree, 1)))
    rest = after;
  else
    take_unit(rest, kDegrees);
  return Measure{*value, 1.0};
}

std::optional<double> compass_deg(std::string_view plain) {
  static constexpr std::pair<std::string_view, std::string_view> kPoints[] = {
      {"n", "north"}, {"nne", "northnortheast"}, {"ne", "northeast"}, {"ene", "eastnortheast"},
      {"e", "east"},  {"ese", "eastsoutheast"},  {"se", "southeast"}, {"sse", "southsoutheast"},
      {"s", "south"}, {"ssw", "southsouthwest"}, {"sw", "southwest"}, {"wsw", "westsouthwest"},
      {"w", "west"},  {"wnw", "westnorthwest"},  {"nw", "northwest"}, {"nnw", "northnorthwest"}};
  std::string word;
  for (const char c : plain)
    if (c != ' ' && c != '-' && c != '_' && c != '.') word += c;
  double deg = 0.0;
  for (const auto& [letters, name] : kPoints) {
    if (word == letters || word == name) return deg;
    deg += 22.5;
  }
  return std::nullopt;
}

double turned_into_circle(double deg) {
  const double turned = std::fmod(deg, 360.0);
  return turned < 0.0 ? turned + 360.0 : turned;
}

}  // namespace

std::optional<Amount> length_from_tag(std::string_view text) {
  return amount_of(text, ";", take_length);
}

std::optional<Amount> count_from_tag(std::string_view text) {
  static constexpr Unit kCounted[] = {
      {"level|levels|storey|storeys|story|stories|floor|floors|lane|lanes", 1.0}};
  return amount_of(text, ";", taker_of(kCounted));
}

std::optional<Amount> volts_from_tag(std::string_view text) {
  static constexpr Unit kVolts[] = {{"v|volt|volts", 1.0}, {"kv", 1000.0}};
  constexpr double kMost_v = 2e6;  // lines have 1.1 MV at most: 110000;20 kV has two units
  const std::optional<Amount> volts = amount_of(text, ";/", taker_of(kVolts));
  return volts && volts->highest <= kMost_v ? volts : std::nullopt;
}

std::optional<double> speed_kmph_from_tag(std::string_view text) {
  static constexpr Unit kSpeeds[] = {
      {"kmh|kph|kmph", 1.0}, {"mph", 1.609344}, {"kn|kt|kts|knot|knots", 1.852}};
  const auto take = [](std::string_view& rest) -> std::optional<Measure> {
    const std::optional<double> value = take_number(rest);
    if (!value) return std::nullopt;
    std::string_view after = rest;
    skip_blanks(after);
    if (skip(after, "km/h")) {
      rest = after;
      return Measure{*value, 1.0};
    }
    return Measure{*value, take_unit(rest, kSpeeds)};
  };
  const std::optional<Amount> amount = amount_of(text, "", take);
  if (!amount || amount->lowest != amount->highest) return std::nullopt;
  return amount->highest;
}

std::optional<double> slope_deg_from_tag(std::string_view text) {
  if (text.size() > kMostBytes) return std::nullopt;
  const std::string plain = plain_text(text);
  std::optional<Amount> amount;
  if (plain.ends_with('%')) {
    amount = amount_of(std::string_view(plain).substr(0, plain.size() - 1), "", taker_of({}));
    if (!amount) return std::nullopt;
    for (double* end : {&amount->lowest, &amount->highest})
      *end = std::atan(*end / 100.0) * 180.0 / std::numbers::pi;
  } else {
    amount = amount_of(text, "", take_degrees);
  }
  if (!amount || amount->lowest < 0.0 || amount->highest >= 90.0) return std::nullopt;
  return amount->middle();
}

std::optional<double> direction_deg_from_tag(std::string_view text) {
  if (text.size() > kMostBytes) return std::nullopt;
  const std::string plain = plain_text(text);
  if (const auto point = compass_deg(plain)) return point;
  std::string_view rest = plain;
  skip_uncertainty(rest);
  const std::optional<Measure> from = take_degrees(rest);
  if (!from || std::abs(from->value) > 720.0) return std::nullopt;
  skip_blanks(rest);
  double deg = from->value;
  if (skip(rest, "-")) {
    skip_blanks(rest);
    const std::optional<Measure> to = take_degrees(rest);
    if (!to || std::abs(to->value) > 720.0) return std::nullopt;
    deg += 0.5 * turned_into_circle(to->value - from->value);
  }
  skip_blanks(rest);
  if (!rest.empty()) return std::nullopt;
  return turned_into_circle(deg);
}

std::optional<bool> flag_from_tag(std::string_view text) {
  if (text.size() > kMostBytes) return std::nullopt;
  const std::string plain = plain_text(text);
  if (is_one_of(plain, "yes|true|on|y|t|1")) return true;
  if (is_one_of(plain, "no|false|off|n|f|0")) return false;
  return std::nullopt;
}

bool is_one_of(std::string_view text, std::string_view choices) {
  while (!choices.empty()) {
    const std::size_t end = std::min(choices.find('|'), choices.size());
    if (choices.substr(0, end) == text) return true;
    choices.remove_prefix(std::min(end + 1, choices.size()));
  }
  return false;
}

}  // namespace terracast::tiler
