#include "tiler/detail.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler {
namespace {

/// Slope that the coarsest octave adds, against the land's own.
constexpr double kSlopeShare = 0.16;
/// Slopes of an octave against those of the one before: below 1, fine detail is smoother than a
/// fractal of one roughness.
constexpr double kSlopeGain = 0.86;
/// Ground rougher than this slope gets no more detail.
constexpr double kSteepest = 1.2;
/// Rock and soil change over this distance.
constexpr double kPatch_m = 180.0;

}  // namespace

Detail::Detail(std::uint64_t seed, int measured_level, double roughness)
    : measured_level_(measured_level), roughness_(roughness), patches_(seed, 0xDE7A) {
  for (int octave = measured_level; octave >= kFinestOctave; --octave)
    octaves_.emplace_back(seed, 0xDE000 + static_cast<std::uint64_t>(octave + 64));
}

double Detail::amplitude_m(double ruggedness) const {
  return roughness_ * kSlopeShare * std::min(ruggedness, kSteepest) * std::exp2(measured_level_);
}

double Detail::height_m(double x_world, double y_world, double ruggedness, int finest_octave,
                        const std::function<double(int octave)>& share) const {
  if (roughness_ == 0.0 || ruggedness <= 0.0 || finest_octave > measured_level_) return 0.0;
  const int count =
      std::min(measured_level_ - finest_octave + 1, static_cast<int>(octaves_.size()));
  const double patch = patches_(x_world / kPatch_m, y_world / kPatch_m);
  // Between smooth meadow and broken rock; finer octaves feel it more.
  const double gain = kSlopeGain * (1.0 + 0.25 * patch);
  double period_m = std::exp2(measured_level_);
  double amplitude_m = roughness_ * kSlopeShare * std::min(ruggedness, kSteepest) * period_m;
  double sum_m = 0.0;
  for (int i = 0; i < count; ++i) {
    const double counting = share ? share(measured_level_ - i) : 1.0;
    if (counting > 0.0)
      sum_m += counting * amplitude_m *
               octaves_[static_cast<std::size_t>(i)](x_world / period_m, y_world / period_m);
    period_m *= 0.5;
    amplitude_m *= 0.5 * gain;
  }
  return sum_m;
}

}  // namespace terracast::tiler
