#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "tiler/gradient_noise.h"

namespace terracast::tiler {

/// Synthetic relief below the spacing of the sources: octaves of gradient noise whose lattices are
/// those of the tiles' levels. The octave of period 2^k vanishes, exactly, at multiples of 2^k:
/// samples of the measured level and coarser hold none.
class Detail {
 public:
  static constexpr int kFinestOctave = -2;

  /// roughness   scales all octaves
  Detail(std::uint64_t seed, int measured_level, double roughness);

  /// Height to add where the slope of the measured land is `ruggedness`.
  /// finest_octave   those below are left out: at places of level L, octaves up to L vanish
  /// share           of an octave, by its number; null: all count fully
  double height_m(double x_world, double y_world, double ruggedness,
                  int finest_octave = kFinestOctave,
                  const std::function<double(int octave)>& share = nullptr) const;

  /// The height's usual size there.
  double amplitude_m(double ruggedness) const;

 private:
  int measured_level_;
  double roughness_;
  GradientNoise patches_;
  std::vector<GradientNoise> octaves_;  ///< from the coarsest
};

}  // namespace terracast::tiler
