#include "geo/paths/polynomial.h"

#include <algorithm>
#include <cmath>

namespace terracast::geo {
namespace {

/// The root in an interval at whose ends the signs differ.
double bisected(std::span<const double> polynomial, double begin, double end) {
  const bool is_rising = value_of(polynomial, begin) < value_of(polynomial, end);
  while (true) {
    const double middle = 0.5 * (begin + end);
    if (middle <= begin || middle >= end) return middle;
    ((value_of(polynomial, middle) < 0.0) == is_rising ? begin : end) = middle;
  }
}

template <class Better>
Extremum best_of(std::span<const double> polynomial, double begin, double end,
                 const Better& is_better) {
  std::vector<double> places = sign_changes_of(derivative_of(polynomial), begin, end);
  places.push_back(end);
  Extremum best{begin, value_of(polynomial, begin)};
  for (const double x : places) {
    const double value = value_of(polynomial, x);
    if (is_better(value, best.value)) best = {x, value};
  }
  return best;
}

}  // namespace

double value_of(std::span<const double> polynomial, double x) {
  double value = 0.0;
  for (std::size_t k = polynomial.size(); k-- > 0;) value = value * x + polynomial[k];
  return value;
}

Polynomial derivative_of(std::span<const double> polynomial) {
  Polynomial derivative;
  for (std::size_t k = 1; k < polynomial.size(); ++k)
    derivative.push_back(static_cast<double>(k) * polynomial[k]);
  return derivative;
}

Polynomial product_of(std::span<const double> a, std::span<const double> b) {
  if (a.empty() || b.empty()) return {};
  Polynomial product(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t k = 0; k < b.size(); ++k) product[i + k] += a[i] * b[k];
  return product;
}

void add_to(Polynomial& sum, std::span<const double> polynomial, double factor) {
  if (sum.size() < polynomial.size()) sum.resize(polynomial.size(), 0.0);
  for (std::size_t k = 0; k < polynomial.size(); ++k) sum[k] += factor * polynomial[k];
}

std::vector<double> sign_changes_of(std::span<const double> polynomial, double begin, double end) {
  if (polynomial.size() < 2) return {};
  std::vector<double> borders = sign_changes_of(derivative_of(polynomial), begin, end);
  borders.push_back(end);
  std::vector<double> roots;
  double before = begin;
  for (const double after : borders) {
    const double at_before = value_of(polynomial, before), at_after = value_of(polynomial, after);
    if ((at_before < 0.0 && at_after >= 0.0) || (at_before > 0.0 && at_after <= 0.0))
      roots.push_back(bisected(polynomial, before, after));
    before = after;
  }
  return roots;
}

Extremum least_of(std::span<const double> polynomial, double begin, double end) {
  return best_of(polynomial, begin, end, [](double a, double b) { return a < b; });
}

Extremum greatest_of(std::span<const double> polynomial, double begin, double end) {
  return best_of(polynomial, begin, end, [](double a, double b) { return a > b; });
}

}  // namespace terracast::geo
