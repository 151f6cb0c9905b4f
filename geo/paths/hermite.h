#pragma once

#include <array>

namespace terracast::geo {

/// A value with its first three derivatives by x.
template <class Value>
using Jet = std::array<Value, 4>;

/// The polynomial of degree 7 that has given values and derivatives at x = 0 and x = 1: with pieces of it a curve is
/// three times continuously differentiable.
/// Value   double or a vector of fixed size
template <class Value>
class SepticPiece {
 public:
  SepticPiece() = default;
  SepticPiece(const Jet<Value>& begin, const Jet<Value>& end) {
    coefficients_ = {begin[0], begin[1], 0.5 * begin[2], begin[3] / 6.0,
                     begin[0], begin[0], begin[0],       begin[0]};
    // What the first four terms lack of the values at x = 1.
    const Value value =
        end[0] - coefficients_[0] - coefficients_[1] - coefficients_[2] - coefficients_[3];
    const Value first = end[1] - coefficients_[1] - 2.0 * coefficients_[2] - 3.0 * coefficients_[3];
    const Value second = end[2] - 2.0 * coefficients_[2] - 6.0 * coefficients_[3];
    const Value third = end[3] - 6.0 * coefficients_[3];
    coefficients_[4] = 35.0 * value - 15.0 * first + 2.5 * second - third / 6.0;
    coefficients_[5] = -84.0 * value + 39.0 * first - 7.0 * second + 0.5 * third;
    coefficients_[6] = 70.0 * value - 34.0 * first + 6.5 * second - 0.5 * third;
    coefficients_[7] = -20.0 * value + 10.0 * first - 2.0 * second + third / 6.0;
  }

  Value value_at(double x) const {
    Value sum = coefficients_[7];
    for (std::size_t k = 7; k-- > 0;) sum = coefficients_[k] + x * sum;
    return sum;
  }
  Jet<Value> at(double x) const {
    Jet<Value> jet{value_at(x), 7.0 * coefficients_[7], 42.0 * coefficients_[7],
                   210.0 * coefficients_[7]};
    for (std::size_t k = 7; k-- > 1;)
      jet[1] = static_cast<double>(k) * coefficients_[k] + x * jet[1];
    for (std::size_t k = 7; k-- > 2;)
      jet[2] = static_cast<double>(k * (k - 1)) * coefficients_[k] + x * jet[2];
    for (std::size_t k = 7; k-- > 3;)
      jet[3] = static_cast<double>(k * (k - 1) * (k - 2)) * coefficients_[k] + x * jet[3];
    return jet;
  }

 private:
  std::array<Value, 8> coefficients_;
};

}  // namespace terracast::geo
