#pragma once

#include <span>
#include <vector>

namespace terracast::geo {

/// Coefficients of a polynomial of one variable, that of the lowest power first.
using Polynomial = std::vector<double>;

double value_of(std::span<const double> polynomial, double x);
Polynomial derivative_of(std::span<const double> polynomial);
Polynomial product_of(std::span<const double> a, std::span<const double> b);
/// Adds `factor` times a polynomial to another.
void add_to(Polynomial& sum, std::span<const double> polynomial, double factor = 1.0);

/// Real roots from `begin` to `end` at which the polynomial changes its sign, increasing. The polynomial is monotone
/// between the roots of its derivative, so that bisection there misses none.
/// accuracy   the last digits of x, or where rounding makes the value's sign uncertain
/// cost       20 us for degree 11
std::vector<double> sign_changes_of(std::span<const double> polynomial, double begin, double end);

/// A place and the value there.
struct Extremum {
  double x;
  double value;
};
/// The least and the greatest value from `begin` to `end`: at an end, or where the derivative changes its sign.
Extremum least_of(std::span<const double> polynomial, double begin, double end);
Extremum greatest_of(std::span<const double> polynomial, double begin, double end);

}  // namespace terracast::geo
