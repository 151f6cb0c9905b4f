#include "validate/text.h"

#include <charconv>
#include <chrono>
#include <cmath>

#include "core/error.h"

namespace terracast::validate {

namespace {

/// Text from outside as it may stand in a message: short, and printable.
std::string shown(std::string_view text) {
  std::string result;
  for (const char c : text.substr(0, 40)) result += (c >= 32 && c < 127) ? c : '?';
  return text.size() > 40 ? result + "…" : result;
}

}  // namespace

std::vector<TextLine> split_lines(std::string_view text) {
  std::vector<TextLine> lines;
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    lines.push_back({++number, line});
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 1);
  }
  return lines;
}

std::vector<std::string_view> split_blanks(std::string_view text) {
  std::vector<std::string_view> parts;
  std::size_t at = 0;
  while (true) {
    at = text.find_first_not_of(" \t", at);
    if (at == std::string_view::npos) return parts;
    const std::size_t end = std::min(text.find_first_of(" \t", at), text.size());
    parts.push_back(text.substr(at, end - at));
    at = end;
  }
}

std::vector<std::string_view> split_at(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

double parse_number(std::string_view text, const std::string& where) {
  double value = 0.0;
  if (text.size() > 1 && text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    core::fail(core::ErrorKind::Input, "{}: \"{}\" is not a finite number", where, shown(text));
  return value;
}

std::int64_t parse_integer(std::string_view text, const std::string& where) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size())
    core::fail(core::ErrorKind::Input, "{}: \"{}\" is not a whole number", where, shown(text));
  return value;
}

std::int64_t parse_utc_ns(std::string_view text, const std::string& where) {
  const std::string_view whole = text;
  const auto refuse = [&] {
    core::fail(core::ErrorKind::Input, "{}: \"{}\" is no time like 2025-06-21 10:00:00.250", where,
               shown(whole));
  };
  if (text.ends_with('Z')) text.remove_suffix(1);
  constexpr std::string_view kForm = "0000-00-00_00:00:00";
  constexpr std::size_t kMostDecimals = 9;
  if (text.size() < kForm.size() || text.size() > kForm.size() + 1 + kMostDecimals ||
      text.size() == kForm.size() + 1)
    refuse();
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char form = i < kForm.size() ? kForm[i] : i == kForm.size() ? '.' : '0';
    const bool fits = form == '0'   ? text[i] >= '0' && text[i] <= '9'
                      : form == '_' ? text[i] == ' ' || text[i] == 'T'
                                    : text[i] == form;
    if (!fits) refuse();
  }
  const auto number = [&](std::size_t at, std::size_t count) {
    int value = 0;
    for (std::size_t i = at; i < at + count; ++i) value = 10 * value + (text[i] - '0');
    return value;
  };
  const std::chrono::year_month_day date{std::chrono::year(number(0, 4)),
                                         std::chrono::month(static_cast<unsigned>(number(5, 2))),
                                         std::chrono::day(static_cast<unsigned>(number(8, 2)))};
  // A year that 64 bits of nanoseconds hold: 1678 to 2261.
  if (!date.ok() || number(0, 4) < 1700 || number(0, 4) > 2200 || number(11, 2) > 23 ||
      number(14, 2) > 59 || number(17, 2) > 59)
    refuse();
  const std::int64_t seconds =
      std::int64_t{86400} * std::chrono::sys_days(date).time_since_epoch().count() +
      3600 * number(11, 2) + 60 * number(14, 2) + number(17, 2);
  std::int64_t nanoseconds = 0;
  std::int64_t digit_ns = 100'000'000;
  for (std::size_t i = kForm.size() + 1; i < text.size(); ++i, digit_ns /= 10)
    nanoseconds += (text[i] - '0') * digit_ns;
  return 1'000'000'000 * seconds + nanoseconds;
}

std::vector<double> parse_numbers(std::string_view text, std::size_t count,
                                  const std::string& where) {
  const std::vector<std::string_view> parts = split_blanks(text);
  if (count > 0 && parts.size() != count)
    core::fail(core::ErrorKind::Input, "{}: {} numbers where {} should be", where, parts.size(),
               count);
  std::vector<double> values;
  values.reserve(parts.size());
  for (const std::string_view part : parts) values.push_back(parse_number(part, where));
  return values;
}

}  // namespace terracast::validate
