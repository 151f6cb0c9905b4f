#pragma once

#include <vector>

#include "geo/paths/continuity.h"

namespace terracast::geo {

/// A B-spline with evenly spaced knots: cubic, twice continuously differentiable, or quintic, four
/// times. It smooths its control values rather than passing through them, and between knots i and
/// i + 1 stays within the range of controls i - reach() + 1 .. i + reach().
class UniformSpline {
 public:
  struct Value {
    double value;
    double first;
    double second;
    double third;  ///< where it jumps, that of the piece that follows
  };

  /// controls   one at each knot from 0 to end, two or more; beyond the ends they repeat. Closed:
  ///            one at each knot but the last, which is the first again.
  UniformSpline(std::vector<double> controls, double end, bool is_closed,
                Continuity continuity = Continuity::Second);

  /// Before 0 and after the end a closed spline goes round, and an open one goes on with its end
  /// control repeated: it settles to that within reach() knots.
  Value at(double u) const;
  double spacing() const { return spacing_; }
  std::size_t num_intervals() const { return num_intervals_; }
  int reach() const { return reach_of(continuity_); }
  static int reach_of(Continuity continuity) { return continuity == Continuity::Fourth ? 3 : 2; }

 private:
  double control(long index) const;
  Value quintic_at(long interval, double b) const;

  std::vector<double> controls_;
  std::size_t num_intervals_;
  double spacing_;
  bool is_closed_;
  Continuity continuity_;
};

/// Weighted means over 2 * reach + 1 neighbours with the weights of a triangle; ends repeat, or
/// join when closed.
std::vector<double> smoothed(const std::vector<double>& values, int reach, bool is_closed);

/// The largest value among the neighbours up to `reach` away on both sides.
std::vector<double> widened(const std::vector<double>& values, int reach, bool is_closed);

}  // namespace terracast::geo
