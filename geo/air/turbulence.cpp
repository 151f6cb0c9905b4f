#include "geo/air/turbulence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/random.h"
#include "geo/paths/hermite.h"

namespace terracast::geo {
namespace {

using Complex = std::complex<double>;

/// Two independent standard normal deviates, by Box and Muller.
std::pair<double, double> normal_pair(std::uint64_t seed, std::uint64_t stream,
                                      std::uint64_t index) {
  const double radius =
      std::sqrt(-2.0 * std::log(1.0 - core::random_unit(seed, stream, 2 * index)));
  const double angle = 2.0 * std::numbers::pi * core::random_unit(seed, stream, 2 * index + 1);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

/// Sum over j of values[j] exp(-2 pi i j k / n), in place; n is a power of two.
void transform(std::vector<Complex>& values) {
  const std::size_t count = values.size();
  TERRACAST_CHECK(std::has_single_bit(count), "a transform of {} values", count);
  for (std::size_t i = 1, reversed = 0; i < count; ++i) {
    std::size_t bit = count >> 1;
    for (; reversed & bit; bit >>= 1) reversed ^= bit;
    reversed ^= bit;
    if (i < reversed) std::swap(values[i], values[reversed]);
  }
  std::vector<Complex> roots(std::max<std::size_t>(count / 2, 1));
  for (std::size_t k = 0; k < roots.size(); ++k)
    roots[k] = std::polar(
        1.0, -2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(count));
  for (std::size_t half = 1; half < count; half *= 2)
    for (std::size_t begin = 0; begin < count; begin += 2 * half)
      for (std::size_t k = 0; k < half; ++k) {
        const Complex odd = roots[k * (count / (2 * half))] * values[begin + half + k];
        values[begin + half + k] = values[begin + k] - odd;
        values[begin + k] += odd;
      }
}

std::vector<double> dryden_nodes(TurbulenceComponent component, std::size_t count,
                                 std::uint64_t seed, std::uint64_t stream) {
  const ShapingFilter filter = dryden_filter(component, UnitTurbulence::kSpacing);
  const ShapingFilter::Matrix noise_root = filter.noise.llt().matrixL();
  const ShapingFilter::Matrix start_root = filter.stationary.llt().matrixL();
  const auto drawn = [&](std::uint64_t index) -> ShapingFilter::Vector {
    const auto [first, second] = normal_pair(seed, stream, index);
    return Eigen::Vector2d(first, second).head(filter.transition.rows());
  };
  std::vector<double> nodes(count);
  ShapingFilter::Vector state = start_root * drawn(0);
  for (std::size_t i = 0; i < count; ++i) {
    nodes[i] = filter.output.dot(state);
    state = (filter.transition * state + noise_root * drawn(i + 1)).eval();
  }
  return nodes;
}

/// Draws with any covariance that a circulant matrix can hold: here all eigenvalues are positive, as the covariance is 0 to double
/// long before half of the circle.
std::vector<double> embedded_nodes(TurbulenceModel model, TurbulenceComponent component,
                                   std::size_t count, std::uint64_t seed, std::uint64_t stream) {
  constexpr double kLeastLengths = 128.0, kCovaryingLengths = 64.0;
  const std::size_t half = std::bit_ceil(
      std::max(count, static_cast<std::size_t>(kLeastLengths / UnitTurbulence::kSpacing)));
  std::vector<Complex> values(2 * half);
  for (std::size_t i = 0; i <= half; ++i) {
    const double lengths = static_cast<double>(i) * UnitTurbulence::kSpacing;
    if (lengths > kCovaryingLengths) break;
    values[i] = turbulence_covariance(model, component, lengths);
    if (i > 0) values[2 * half - i] = values[i];
  }
  transform(values);
  double most = 0.0;
  for (const Complex& eigenvalue : values) most = std::max(most, eigenvalue.real());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double eigenvalue = values[i].real();
    TERRACAST_CHECK(eigenvalue > -1e-12 * most, "an eigenvalue of {} beside {}", eigenvalue, most);
    const double size = std::sqrt(std::max(eigenvalue, 0.0) / static_cast<double>(values.size()));
    const auto [real, imaginary] = normal_pair(seed, stream, i);
    values[i] = {size * real, size * imaginary};
  }
  transform(values);
  std::vector<double> nodes(count);
  for (std::size_t i = 0; i < count; ++i) nodes[i] = values[i].real();
  return nodes;
}

double von_karman_covariance(TurbulenceComponent component, double lengths) {
  constexpr double kScale = 1.339;
  constexpr double kThird = 1.0 / 3.0;
  const double x = lengths / kScale;
  if (x == 0.0) return 1.0;
  if (x > 700.0) return 0.0;  // below the least double
  const double factor = std::pow(2.0, 2.0 * kThird) / std::tgamma(kThird) * std::cbrt(x);
  const double along = factor * std::cyl_bessel_k(kThird, x);
  if (component == TurbulenceComponent::Along) return along;
  // f + r f' / 2, and d/dx of x^n K_n is -x^n K_(n-1).
  return along - 0.5 * x * factor * std::cyl_bessel_k(2.0 * kThird, x);
}

}  // namespace

double turbulence_covariance(TurbulenceModel model, TurbulenceComponent component, double lengths) {
  if (model == TurbulenceModel::VonKarman) return von_karman_covariance(component, lengths);
  const double along = std::exp(-lengths);
  return component == TurbulenceComponent::Along ? along : along * (1.0 - 0.5 * lengths);
}

ShapingFilter dryden_filter(TurbulenceComponent component, double step_lengths) {
  TERRACAST_CHECK(step_lengths > 0.0, "a step of {} lengths", step_lengths);
  const double decay = std::exp(-step_lengths);
  using Matrix = ShapingFilter::Matrix;
  if (component == TurbulenceComponent::Along)
    return {.transition = Matrix::Constant(1, 1, decay),
            .noise = Matrix::Constant(1, 1, -std::expm1(-2.0 * step_lengths)),
            .stationary = Matrix::Identity(1, 1),
            .output = ShapingFilter::Vector::Ones(1)};
  // (1 + sqrt(3) s) / (1 + s)^2 in controllable form: A = [0 1; -1 -2], of which -1 is twice the eigenvalue, and the stationary
  // covariance P of A P + P A' + B B' = 0 is a quarter of the identity.
  Matrix transition(2, 2);
  transition << 1.0 + step_lengths, step_lengths, -step_lengths, 1.0 - step_lengths;
  transition *= decay;
  const Matrix stationary = 0.25 * Matrix::Identity(2, 2);
  const Matrix kept = transition * stationary * transition.transpose();
  // What Van Loan's integral of exp(A s) B B' exp(A' s) over the step comes to.
  return {.transition = transition,
          .noise = stationary - kept,
          .stationary = stationary,
          .output = Eigen::Vector2d(1.0, std::sqrt(3.0))};
}

UnitTurbulence::UnitTurbulence(TurbulenceModel model, TurbulenceComponent component,
                               double end_lengths, std::uint64_t seed, std::uint64_t stream)
    : end_lengths_(end_lengths) {
  if (!(end_lengths >= 0.0 && end_lengths <= kMostLengths))
    core::fail(core::ErrorKind::Input,
               "turbulence over {:.0f} of its lengths, and at most {:.0f} are drawn; fly a shorter "
               "way, or higher above the ground, where eddies are larger",
               end_lengths, kMostLengths);
  const std::size_t count =
      static_cast<std::size_t>(std::floor(end_lengths / kSpacing)) + 2 + 2 * kBeyond;
  nodes_ = model == TurbulenceModel::Dryden ? dryden_nodes(component, count, seed, stream)
                                            : embedded_nodes(model, component, count, seed, stream);
}

double UnitTurbulence::at(double lengths) const {
  TERRACAST_CHECK(lengths >= 0.0 && lengths <= end_lengths_, "turbulence at {} of {} lengths",
                  lengths, end_lengths_);
  const double place = lengths / kSpacing;
  const double before = std::floor(place);
  const double* node = &nodes_[static_cast<std::size_t>(before) + kBeyond];
  // Derivatives by central differences of seven nodes.
  const auto jet_at = [](const double* n) -> Jet<double> {
    return {n[0], (n[3] - n[-3] - 9.0 * (n[2] - n[-2]) + 45.0 * (n[1] - n[-1])) / 60.0,
            (2.0 * (n[3] + n[-3]) - 27.0 * (n[2] + n[-2]) + 270.0 * (n[1] + n[-1]) - 490.0 * n[0]) /
                180.0,
            (-(n[3] - n[-3]) + 8.0 * (n[2] - n[-2]) - 13.0 * (n[1] - n[-1])) / 8.0};
  };
  return SepticPiece<double>(jet_at(node), jet_at(node + 1)).value_at(place - before);
}

}  // namespace terracast::geo
