#include "geo/fixes/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/error.h"
#include "geo/sun.h"

namespace terracast::geo {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

/// Cuts "+02:00", "-0330" or "Z" off the end; seconds that the clock is ahead of UTC.
std::optional<double> cut_zone(std::string_view& text) {
  constexpr std::size_t kTimeOfDayEnd = 19;
  if (text.size() <= kTimeOfDayEnd) return std::nullopt;
  if (text.back() == 'Z' || text.back() == 'z') {
    text.remove_suffix(1);
    return 0.0;
  }
  const std::size_t sign = text.find_first_of("+-", kTimeOfDayEnd);
  if (sign == std::string_view::npos) return std::nullopt;
  std::string digits(text.substr(sign + 1));
  std::erase(digits, ':');
  if (digits.size() == 2) digits += "00";
  if (digits.size() != 4 || digits.find_first_not_of("0123456789") != std::string::npos)
    return std::nullopt;
  constexpr int kMostHours = 14, kMinutes = 60;
  const int hours = std::stoi(digits.substr(0, 2)), minutes = std::stoi(digits.substr(2));
  if (hours > kMostHours || minutes >= kMinutes) return std::nullopt;
  const double ahead_s = hours * 3600.0 + minutes * 60.0;
  const bool is_behind = text[sign] == '-';
  text = text.substr(0, sign);
  return is_behind ? -ahead_s : ahead_s;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::optional<double> number_of(std::string_view text) {
  std::string_view digits = trimmed(text);
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlanks, end);
  }
  return words;
}

std::vector<std::string_view> lines_of_text(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    lines.push_back(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

double unix_seconds_from_text(std::string_view text, double utc_offset_h,
                              const std::string& where) {
  constexpr std::size_t kDateEnd = 10, kTimeOfDayEnd = 19, kMostDigits = 9;
  std::string_view rest = trimmed(text);
  const double ahead_s = cut_zone(rest).value_or(utc_offset_h * 3600.0);
  std::string utc(rest);
  if (utc.size() >= kTimeOfDayEnd) {
    if (utc[4] == '.' && utc[7] == '.') utc[4] = utc[7] = '-';
    if (utc[kDateEnd] == ' ') utc[kDateEnd] = 'T';
    if (utc.size() > kTimeOfDayEnd && utc[kTimeOfDayEnd] == ',') utc[kTimeOfDayEnd] = '.';
    utc.erase(std::remove(utc.begin() + kTimeOfDayEnd, utc.end(), ','), utc.end());
    // Digits beyond those that count go; what is no digit stays, and is refused.
    const std::size_t counted = kTimeOfDayEnd + 1 + kMostDigits;
    if (utc.find_first_not_of("0123456789", kTimeOfDayEnd + 1) == std::string::npos)
      utc.resize(std::min(utc.size(), counted));
  }
  try {
    return unix_seconds_from_utc(utc + "Z") - ahead_s;
  } catch (const core::Error&) {
    core::fail(core::ErrorKind::Input,
               "{}: \"{}\" is no time; one like 2025-06-21T10:00:00.250Z is expected", where, text);
  }
}

}  // namespace terracast::geo
