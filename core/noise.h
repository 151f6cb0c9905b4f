#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>

#include "core/lanes.h"
#include "core/packet_code.h"

/// Band-limited noise, anchored in the world. An octave is gradient noise on a square lattice whose
/// spacing is 2^level m; its coordinates are whole numbers of 2^-12 m, so that it is as sharp 25 km
/// from the origin as at it, and equal from every view. Packets of kLanes places; all functions are
/// pure.
namespace terracast::core {

/// Levels that exist: lattices of 4096 m to 1/128 m.
inline constexpr int kCoarsestNoiseLevel = 12;
inline constexpr int kFinestNoiseLevel = -7;

/// The step of coordinates.
inline constexpr double kNoiseStep_m = 0x1.0p-12;

/// Coordinates in steps, rounded down exactly, modulo 2^32. Of magnitudes below 2^38 m.
TERRACAST_PACKET_INLINE void count_steps(const Lanes<double>& metres, Lanes<std::int32_t>& steps) {
  // Adding this rounds to a whole number, which then is the sum's last bits, also below zero.
  constexpr double kWhole = 0x1.8p52;
  Lanes<std::uint64_t> bits;
  for (int i = 0; i < kLanes; ++i) {
    const double exact = metres[i] * (1.0 / kNoiseStep_m);
    const double nearest = exact + kWhole;
    const double below = nearest - 1.0;
    bits[i] = std::bit_cast<std::uint64_t>(nearest - kWhole > exact ? below : nearest);
  }
  for (int i = 0; i < kLanes; ++i)
    steps[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(bits[i]));
}

/// The planes that noise is laid out on. Each is sheared along the vertical its own way, so that a
/// wall of any direction has a plane whose texture is not stretched on it; octaves take them in
/// turn.
inline constexpr int kNumNoisePlanes = 3;

/// World directions along which a plane's two coordinates grow, m per m.
struct NoisePlane {
  Eigen::Vector3d u;
  Eigen::Vector3d v;
};
const std::array<NoisePlane, kNumNoisePlanes>& noise_planes();

/// Places of a packet in each plane, and what an image sample covers there.
struct NoisePlaces {
  Lanes<std::int32_t> u[kNumNoisePlanes];
  Lanes<std::int32_t> v[kNumNoisePlanes];
  Lanes<float>
      footprint_m;  ///< width of a sample on the ground; octaves finer than it are left out

  /// Coordinates repeat after 2^20 m.
  void set(const Lanes3d& points_world, const Lanes<double>& footprints_m);
};

/// Sum of octaves.
struct NoiseSum {
  Lanes<float> value;     ///< root mean square 1 when no octave is left out
  Lanes<float> left_out;  ///< root mean square of what the footprint left out
};

/// The sum's slope: in each plane along u and v, with octaves weighted so that each adds a slope of
/// root mean square 1.
struct NoiseSlope {
  Lanes<float> u[kNumNoisePlanes];
  Lanes<float> v[kNumNoisePlanes];
};

/// Adds up the octaves coarsest_level, coarsest_level - 1, …, finest_level with equal weights. An
/// octave of spacing s vanishes smoothly as the footprint grows from s / 2 to s.
NoiseSum sum_noise(const NoisePlaces& places, int coarsest_level, int finest_level,
                   std::uint32_t seed);

/// The sum at points: as sum_noise at a footprint of 0, to the last bit.
Lanes<float> sum_all_noise(const NoisePlaces& places, int coarsest_level, int finest_level,
                           std::uint32_t seed);

/// As sum_noise, and its slope added to `slope`: octave by octave scaled by `slope_weight`[lane], for
/// octaves finer than `slope_below_m`[lane] only (what is coarser stands in the terrain itself).
NoiseSum sum_noise_with_slope(const NoisePlaces& places, int coarsest_level, int finest_level,
                              std::uint32_t seed, const Lanes<float>& slope_weight,
                              const Lanes<float>& slope_below_m, NoiseSlope& slope);

/// One sum of octaves over coordinates of the caller's (in steps of 2^-12 m), such as height and a
/// stretched distance.
NoiseSum sum_noise_at(const Lanes<std::int32_t>& u, const Lanes<std::int32_t>& v,
                      const Lanes<float>& footprint_m, int coarsest_level, int finest_level,
                      std::uint32_t seed);

/// As sum_noise_at, and its slope along u, per unit of u, added to `slope_u`: octave by octave scaled
/// by `slope_weight`[lane], so that each adds one of root mean square 1 times that.
NoiseSum sum_noise_at_with_slope(const Lanes<std::int32_t>& u, const Lanes<std::int32_t>& v,
                                 const Lanes<float>& footprint_m, int coarsest_level,
                                 int finest_level, std::uint32_t seed,
                                 const Lanes<float>& slope_weight, Lanes<float>& slope_u);

}  // namespace terracast::core
