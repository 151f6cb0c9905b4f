#pragma once

#include <optional>
#include <string_view>

namespace terracast::geo {

/// A time of which whole seconds and the rest are kept apart: as one double, seconds since 1970 are rounded to 2.4e-7 s,
/// by which a motion sampled at 200 Hz accelerates falsely by 1e-2 of its speed a second.
struct ExactTime {
  double whole_s = 0.0;  ///< a whole number
  double rest_s = 0.0;   ///< of the order of 1

  static ExactTime of(double time_s);
  double rounded_s() const { return whole_s + rest_s; }
};

/// A decimal number, with a point or a comma, of units of 10^unit_exponent s.
/// accuracy   whole seconds exactly; the rest to 1e-16 s
/// returns    nothing where the text is no such number, or its whole seconds are no exact double
std::optional<ExactTime> exact_time_of(std::string_view decimal, int unit_exponent);

/// Brings times from far zeros (1970, a GPS week's) near zero, by the whole seconds of the first one.
class NearZero {
 public:
  double next_s(const ExactTime& time);
  /// Of the times that came, on their own clock: 0 where the first is within 1e6 s of its zero, since as a double it is
  /// then as good as its file.
  double zero_s() const { return zero_s_.value_or(0.0); }

 private:
  std::optional<double> zero_s_;
};

}  // namespace terracast::geo
