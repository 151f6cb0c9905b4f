#include "geo/fixes/exact_time.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "geo/fixes/text.h"

namespace terracast::geo {
namespace {

constexpr std::ptrdiff_t kMostWholeDigits = 15;  // each such number is a double
constexpr std::ptrdiff_t kMostZeros = 300;

/// 0.DIGITS times ten to the power of `point`.
struct Decimal {
  bool is_negative = false;
  std::string digits;
  std::ptrdiff_t point = 0;
};

std::optional<Decimal> decimal_of(std::string_view text) {
  Decimal decimal;
  if (!text.empty() && (text[0] == '+' || text[0] == '-')) {
    decimal.is_negative = text[0] == '-';
    text.remove_prefix(1);
  }
  const std::size_t end = std::min(text.find_first_of("eE"), text.size());
  const std::size_t point = std::min(text.substr(0, end).find_first_of(".,"), end);
  for (std::size_t i = 0; i < end; ++i) {
    if (i == point) continue;
    if (text[i] < '0' || text[i] > '9') return std::nullopt;
    decimal.digits += text[i];
  }
  if (decimal.digits.empty()) return std::nullopt;
  decimal.point = static_cast<std::ptrdiff_t>(point);
  if (end == text.size()) return decimal;
  std::string_view power_text = text.substr(end + 1);
  if (power_text.starts_with("+")) power_text.remove_prefix(1);
  int power = 0;
  const auto [stop, error] =
      std::from_chars(power_text.data(), power_text.data() + power_text.size(), power);
  if (error != std::errc() || stop != power_text.data() + power_text.size()) return std::nullopt;
  decimal.point += power;
  return decimal;
}

}  // namespace

ExactTime ExactTime::of(double time_s) {
  const double whole_s = std::trunc(time_s);
  return {.whole_s = whole_s, .rest_s = time_s - whole_s};
}

std::optional<ExactTime> exact_time_of(std::string_view decimal_text, int unit_exponent) {
  auto decimal = decimal_of(trimmed(decimal_text));
  if (!decimal) return std::nullopt;
  const std::ptrdiff_t point = decimal->point + unit_exponent;
  const auto num_digits = static_cast<std::ptrdiff_t>(decimal->digits.size());
  if (point > kMostWholeDigits || point < -kMostZeros) return std::nullopt;
  std::string whole = "0";
  std::string rest = "0.";
  for (std::ptrdiff_t place = std::min<std::ptrdiff_t>(point, 0);
       place < std::max(point, num_digits); ++place) {
    const bool is_stated = place >= 0 && place < num_digits;
    const char digit = is_stated ? decimal->digits[static_cast<std::size_t>(place)] : '0';
    (place < point ? whole : rest) += digit;
  }
  const double sign = decimal->is_negative ? -1.0 : 1.0;
  return ExactTime{.whole_s = sign * number_of(whole).value_or(0.0),
                   .rest_s = sign * number_of(rest + "0").value_or(0.0)};
}

double NearZero::next_s(const ExactTime& time) {
  constexpr double kNear_s = 1e6;  // rounded to 1.2e-10 s
  if (!zero_s_) zero_s_ = std::abs(time.whole_s) < kNear_s ? 0.0 : time.whole_s;
  return time.whole_s - *zero_s_ + time.rest_s;
}

}  // namespace terracast::geo
