#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

/// The light that a pixel of an event camera sees over time, and what its photoreceptor makes of it.
namespace terracast::sensors::events {

/// The logarithm of a pixel's luminance at a time.
struct LightSample {
  double time_s = 0.0;
  double log_light = 0.0;
};

/// A cubic over an interval of time: a + b x + c x^2 + d x^3, x counted from its start.
struct Cubic {
  double start_s = 0.0;
  double length_s = 0.0;
  std::array<double, 4> coefficients{};

  double at(double x) const {
    const auto& [a, b, c, d] = coefficients;
    return a + x * (b + x * (c + x * d));
  }
  /// Where its derivative is 0 strictly inside the interval, ascending; `count` of them.
  struct Extrema {
    std::array<double, 2> x{};
    std::size_t count = 0;
  };
  Extrema extrema() const;
};

/// Cubics between samples with one derivative at each sample: that of the parabola through it and its neighbours, limited
/// so that each cubic is monotone (Fritsch and Carlson 1980). A ramp comes back exactly.
/// samples   two or more, at increasing times
/// before    the last one before them: gives the first cubic the derivative at its start; may be nothing
void join_monotone(std::span<const LightSample> samples, const std::optional<LightSample>& before,
                   std::vector<Cubic>& curve);

/// The answer u of a first-order low-pass to a cubic: u' = rate (cubic - u).
class Filtered {
 public:
  /// rate_per_s   2 pi times the cutoff; 0: there is no filter, and the answer is the cubic
  /// level        u at the cubic's start; does not count without a filter
  Filtered(const Cubic& cubic, double rate_per_s, double level)
      : cubic_(cubic), rate_per_s_(rate_per_s), level_(level) {}

  /// x          counted from the cubic's start
  /// accuracy   1e-12 of the largest value; LightCurve.TheFilterIsItsDifferentialEquation
  double at(double x) const;

  /// Calls visit(from, to) for parts of the interval within which the answer is monotone, in order. For a cubic that is
  /// monotone the answer turns where it meets it, once at most: behind that it runs after it.
  template <class Visit>
  void for_each_monotone_part(const Visit& visit) const {
    const Cubic::Extrema extrema = cubic_.extrema();
    double from = 0.0;
    for (std::size_t i = 0; i <= extrema.count; ++i) {
      const double to = i < extrema.count ? extrema.x[i] : cubic_.length_s;
      if (const std::optional<double> turn = turn_within(from, to)) {
        visit(from, *turn);
        from = *turn;
      }
      visit(from, to);
      from = to;
    }
  }

 private:
  std::optional<double> turn_within(double from, double to) const;

  const Cubic& cubic_;
  double rate_per_s_;
  double level_;
};

/// Where a function that is monotone between two places first reaches a value that it does not have before: it has it there,
/// or has passed it by what it changes in 1e-11 s.
/// from, to   it is short of the value at `from`, and has it or has passed it at `to`
template <class Function>
double first_place_of(const Function& function, double value, double from, double to) {
  constexpr double kClose_s = 1e-11;
  double below = function(from) - value;
  double above = function(to) - value;
  const bool is_rising = above > below;
  for (int i = 0; i < 200 && to - from > kClose_s && above != 0.0; ++i) {
    double middle = from - below * (to - from) / (above - below);
    // The secant alone may creep up from one side.
    if (i % 3 == 2 || !(middle > from && middle < to)) middle = 0.5 * (from + to);
    if (!(middle > from && middle < to)) break;
    const double here = function(middle) - value;
    const bool is_reached = is_rising ? here >= 0.0 : here <= 0.0;
    (is_reached ? to : from) = middle;
    (is_reached ? above : below) = here;
  }
  return to;
}

}  // namespace terracast::sensors::events
