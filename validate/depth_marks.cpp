#include "validate/depth_marks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>

namespace terracast::validate {

namespace {

constexpr std::size_t kEnoughValues = 500;
constexpr double kNearlyAll = 0.9;

/// Share of the values that are whole multiples of a step, of those that would not mostly be so by chance: float32
/// rounds by half its last digit.
double share_of_multiples(const std::vector<float>& values, double step_m) {
  constexpr double kLikely = 0.05;
  std::size_t num_multiples = 0, num_told = 0;
  for (const float value : values) {
    const auto exact = static_cast<double>(value);
    const double rounding_m =
        0.5 *
        (static_cast<double>(std::nextafter(value, std::numeric_limits<float>::max())) - exact);
    const double tolerance = 1.01 * rounding_m / step_m;
    if (2.0 * tolerance > kLikely) continue;
    ++num_told;
    const double multiple = exact / step_m;
    if (std::abs(multiple - std::round(multiple)) <= tolerance + 1e-9) ++num_multiples;
  }
  return num_told < kEnoughValues
             ? 0.0
             : static_cast<double>(num_multiples) / static_cast<double>(num_told);
}

/// Decimal and binary parts of a metre, the coarsest first.
std::vector<double> known_steps_m() {
  std::vector<double> steps;
  for (const double unit_m : {1.0, 0.1, 0.01, 0.001, 0.0001})
    for (const double part : {1.0, 0.5, 0.25, 0.2}) steps.push_back(unit_m * part);
  for (int power = 3; power <= 12; ++power) steps.push_back(std::ldexp(1.0, -power));
  std::sort(steps.begin(), steps.end(), std::greater<>());
  return steps;
}

/// Significant binary digits of a float32, at most 24.
int num_bits_of(float value) {
  constexpr std::uint32_t kMantissa = (1U << 23U) - 1U;
  const std::uint32_t mantissa = std::bit_cast<std::uint32_t>(value) & kMantissa;
  return mantissa == 0 ? 1 : 24 - std::countr_zero(mantissa);
}

/// The digits that nearly all values have at most, in each octave that has many of them; 24 where octaves differ, as
/// they do of fixed steps.
int num_bits_of(const std::vector<float>& values) {
  constexpr std::size_t kMany = 100;
  std::array<std::vector<int>, 256> bits;
  for (const float value : values)
    bits[std::bit_cast<std::uint32_t>(value) >> 23U & 0xffU].push_back(num_bits_of(value));
  int common = 0;
  for (std::vector<int>& octave : bits) {
    if (octave.size() < kMany) continue;
    const auto rank = static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(octave.size() - 1));
    std::nth_element(octave.begin(), octave.begin() + rank, octave.end());
    if (common != 0 && octave[static_cast<std::size_t>(rank)] != common) return 24;
    common = octave[static_cast<std::size_t>(rank)];
  }
  return common == 0 ? 24 : common;
}

}  // namespace

std::optional<DepthSteps> find_steps(const core::ImageF& depth) {
  constexpr std::size_t kPixels = 20'000;  // tell as much as all
  const std::size_t step = std::max<std::size_t>(1, depth.data().size() / kPixels);
  std::vector<float> values;
  for (std::size_t i = 0; i < depth.data().size(); i += step)
    if (const float value = depth.data()[i]; std::isfinite(value) && value > 0.0F)
      values.push_back(value);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  if (values.size() < kEnoughValues) return std::nullopt;
  constexpr int kFloat16 = 11, kBfloat16 = 8;
  const int num_bits = num_bits_of(values);
  if (num_bits == kFloat16 || num_bits == kBfloat16) return DepthSteps{0.0, num_bits, 1.0};
  DepthSteps best;
  for (const double step_m : known_steps_m()) {
    const double share = share_of_multiples(values, step_m);
    if (share <= best.share) continue;
    best = {step_m, 0, share};
    if (share >= kNearlyAll) break;
  }
  return best;
}

}  // namespace terracast::validate
