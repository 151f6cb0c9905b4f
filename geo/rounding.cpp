#include "geo/rounding.h"

#include <algorithm>
#include <cmath>

namespace terracast::geo {

double length_error(const Eigen::Quaterniond& q) {
  using Real = long double;
  Real square = 0;
  for (int i = 0; i < 4; ++i) square += Real(q.coeffs()[i]) * Real(q.coeffs()[i]);
  constexpr double kOfItself = 0.01;  // long double has 11 bits more
  return static_cast<double>(std::abs(square - 1)) / kU + kOfItself;
}

// With sine s of half the angle and its cosine w, 2 (s v) has 2.5 s roundings, the product with w one more; the
// second product of vectors has those of both; two sums.
double turn_error(const Eigen::Quaterniond& q) {
  const double sine = q.vec().norm(), cosine = std::abs(q.w());
  return 2.0 * sine * cosine * 3.5 + 2.0 * sine * sine * 5.0 + 2.0 + 2.0 * length_error(q);
}

double rounding_of(double largest) {
  constexpr double kOfItself = 1.0 + 0x1.0p-30;
  constexpr int kFractionBits = 53;
  if (largest == 0.0) return 0.0;
  constexpr int kLeast = -1022 + kFractionBits;  // steps of what is smaller are no normal numbers
  return power_of_two(std::max(exponent_of(largest * kOfItself), kLeast) - kFractionBits);
}

}  // namespace terracast::geo
