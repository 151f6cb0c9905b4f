#include "core/noise.h"

#include <algorithm>
#include <cmath>

#include "core/packet_code.h"

namespace terracast::core {
namespace {

constexpr int kStepBits = 12;  // kNoiseStep_m = 2^-12
// Root mean square of one octave of the noise below and of its slope, by quadrature over 4e6 places
// (Noise.OctavesHaveUnitRms): values are scaled to 1.
constexpr float kUnitValue = 0x1p-31f / 0.1760f;
constexpr float kUnitSlope = 0x1p-31f / 0.5098f;

struct Octave {
  Lanes<float> value;
  Lanes<float> du;  // per lattice cell
  Lanes<float> dv;
};

TERRACAST_PACKET_INLINE std::uint32_t hash_of(std::uint32_t h) {
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  return h ^ (h >> 15);
}

// Components of a gradient from the two halves of a hash, in [-1, 1) times 2^31; kUnitValue and
// kUnitSlope hold the 2^-31.
TERRACAST_PACKET_INLINE float first_component(std::uint32_t h) {
  return static_cast<float>(static_cast<std::int32_t>(h));
}
TERRACAST_PACKET_INLINE float second_component(std::uint32_t h) {
  return static_cast<float>(static_cast<std::int32_t>(h << 16));
}

/// Gradient noise (Perlin 2002, quintic fade): gradients uniform in the square [-1, 1]^2.
template <bool kWithSlope>
TERRACAST_PACKET_INLINE void evaluate_octave(const Lanes<std::int32_t>& u,
                                             const Lanes<std::int32_t>& v, int level,
                                             std::uint32_t seed, Octave& octave) {
  const int shift = kStepBits + level;
  const std::int32_t mask = (std::int32_t{1} << shift) - 1;
  const float per_step = 1.0f / static_cast<float>(std::int32_t{1} << shift);
  const std::uint32_t salt = seed + static_cast<std::uint32_t>(level + 64) * 0x9e3779b9u;
  for (int i = 0; i < kLanes; ++i) {
    const float fu = static_cast<float>(u[i] & mask) * per_step;
    const float fv = static_cast<float>(v[i] & mask) * per_step;
    const std::uint32_t cu = static_cast<std::uint32_t>(u[i] >> shift) * 0x85ebca6bu + salt;
    const std::uint32_t cv = static_cast<std::uint32_t>(v[i] >> shift) * 0xc2b2ae35u;
    const std::uint32_t cu1 = cu + 0x85ebca6bu;
    const std::uint32_t cv1 = cv + 0xc2b2ae35u;
    const std::uint32_t h00 = hash_of(cu ^ cv);
    const std::uint32_t h10 = hash_of(cu1 ^ cv);
    const std::uint32_t h01 = hash_of(cu ^ cv1);
    const std::uint32_t h11 = hash_of(cu1 ^ cv1);
    const float gu00 = first_component(h00), gv00 = second_component(h00);
    const float gu10 = first_component(h10), gv10 = second_component(h10);
    const float gu01 = first_component(h01), gv01 = second_component(h01);
    const float gu11 = first_component(h11), gv11 = second_component(h11);
    const float d00 = gu00 * fu + gv00 * fv;
    const float d10 = gu10 * (fu - 1.0f) + gv10 * fv;
    const float d01 = gu01 * fu + gv01 * (fv - 1.0f);
    const float d11 = gu11 * (fu - 1.0f) + gv11 * (fv - 1.0f);
    const float su = fu * fu * fu * (fu * (fu * 6.0f - 15.0f) + 10.0f);
    const float sv = fv * fv * fv * (fv * (fv * 6.0f - 15.0f) + 10.0f);
    const float low = d00 + su * (d10 - d00);
    const float high = d01 + su * (d11 - d01);
    octave.value[i] = low + sv * (high - low);
    if constexpr (!kWithSlope) continue;
    const float su1 = 30.0f * fu * fu * (fu * (fu - 2.0f) + 1.0f);
    const float sv1 = 30.0f * fv * fv * (fv * (fv - 2.0f) + 1.0f);
    const float gu_low = gu00 + su * (gu10 - gu00);
    const float gu_high = gu01 + su * (gu11 - gu01);
    const float gv_low = gv00 + su * (gv10 - gv00);
    const float gv_high = gv01 + su * (gv11 - gv01);
    const float across_low = d10 - d00;
    const float across_high = d11 - d01;
    octave.du[i] =
        gu_low + sv * (gu_high - gu_low) + su1 * (across_low + sv * (across_high - across_low));
    octave.dv[i] = gv_low + sv * (gv_high - gv_low) + sv1 * (high - low);
  }
}

/// 1 while the footprint is below half the spacing, 0 from the spacing on, smooth between.
TERRACAST_PACKET_INLINE void weigh_octave(const Lanes<float>& footprint_m, float spacing_m,
                                          Lanes<float>& weight) {
  const float per_spacing = 1.0f / spacing_m;
  for (int i = 0; i < kLanes; ++i) {
    const float x = smaller(larger(2.0f - 2.0f * footprint_m[i] * per_spacing, 0.0f), 1.0f);
    weight[i] = x * x * (3.0f - 2.0f * x);
  }
}

float least_of(const Lanes<float>& lanes) {
  return *std::min_element(lanes.values, lanes.values + kLanes);
}

TERRACAST_PACKET_INLINE float scale_of(int num_octaves) {
  return kUnitValue / std::sqrt(static_cast<float>(num_octaves));
}

TERRACAST_PACKET_INLINE void finish(int num_octaves, NoiseSum& sum) {
  const float scale = scale_of(num_octaves);
  const float share = 1.0f / static_cast<float>(num_octaves);
  for (int i = 0; i < kLanes; ++i) {
    sum.value[i] *= scale;
    sum.left_out[i] = std::sqrt(larger(0.0f, 1.0f - sum.left_out[i] * share));
  }
}

TERRACAST_PACKET_INLINE void clear(NoiseSum& sum) {
  for (int i = 0; i < kLanes; ++i) {
    sum.value[i] = 0.0f;
    sum.left_out[i] = 0.0f;  // holds the power let through until finish()
  }
}

TERRACAST_PACKET_INLINE void add_octave(const Octave& octave, const Lanes<float>& weight,
                                        NoiseSum& sum) {
  for (int i = 0; i < kLanes; ++i) {
    sum.value[i] += weight[i] * octave.value[i];
    sum.left_out[i] += weight[i] * weight[i];
  }
}

TERRACAST_PACKET_CODE void find_coordinates(const Lanes3d& points, const double* axis,
                                            Lanes<std::int32_t>& coordinates) {
  const double x = axis[0];
  const double y = axis[1];
  const double z = axis[2];
  Lanes<double> along_m;
  for (int i = 0; i < kLanes; ++i)
    along_m[i] = x * points[0][i] + y * points[1][i] + z * points[2][i];
  count_steps(along_m, coordinates);
}

constexpr int plane_of(int level) { return (level + 3 * 64) % kNumNoisePlanes; }

/// What sum_octaves() makes of an octave beside the sum.
struct NoSlope {
  static constexpr bool kIsWanted = false;
};
/// Its slope in its plane, of octaves finer than a bound.
struct SlopeInPlanes {
  static constexpr bool kIsWanted = true;
  const Lanes<float>& weight;
  const Lanes<float>& below_m;
  NoiseSlope& slope;

  TERRACAST_PACKET_INLINE void add(const Octave& octave, const Lanes<float>& octave_weight,
                                   float spacing_m, int plane) const {
    for (int i = 0; i < kLanes; ++i) {
      // In by degrees over one octave: full below half the bound.
      const float inside = smaller(larger(2.0f - 2.0f * spacing_m / below_m[i], 0.0f), 1.0f);
      const float scale = octave_weight[i] * inside * weight[i] * kUnitSlope;
      slope.u[plane][i] += scale * octave.du[i];
      slope.v[plane][i] += scale * octave.dv[i];
    }
  }
};
/// Its slope along u.
struct SlopeAlongU {
  static constexpr bool kIsWanted = true;
  const Lanes<float>& weight;
  Lanes<float>& slope_u;

  TERRACAST_PACKET_INLINE void add(const Octave& octave, const Lanes<float>& octave_weight, float,
                                   int) const {
    for (int i = 0; i < kLanes; ++i)
      slope_u[i] += octave_weight[i] * weight[i] * kUnitSlope * octave.du[i];
  }
};

/// u, v   of kNumPlanes planes, which octaves take in turn
template <int kNumPlanes, class Slope>
TERRACAST_PACKET_INLINE void sum_octaves(const Lanes<std::int32_t>* u, const Lanes<std::int32_t>* v,
                                         const Lanes<float>& footprint_m, int coarsest_level,
                                         int finest_level, std::uint32_t seed, const Slope& slope,
                                         NoiseSum& sum) {
  clear(sum);
  const float finest_footprint_m = least_of(footprint_m);
  Lanes<float> weight;
  Octave octave;
  for (int level = coarsest_level; level >= finest_level; --level) {
    const float spacing_m = std::ldexp(1.0f, level);
    if (spacing_m <= finest_footprint_m) break;
    weigh_octave(footprint_m, spacing_m, weight);
    const int plane = kNumPlanes == 1 ? 0 : plane_of(level);
    evaluate_octave<Slope::kIsWanted>(u[plane], v[plane], level, seed, octave);
    add_octave(octave, weight, sum);
    if constexpr (Slope::kIsWanted) slope.add(octave, weight, spacing_m, plane);
  }
  finish(coarsest_level - finest_level + 1, sum);
}

TERRACAST_PACKET_CODE void sum_planes(const NoisePlaces& places, int coarsest_level,
                                      int finest_level, std::uint32_t seed, NoiseSum& sum) {
  sum_octaves<kNumNoisePlanes>(places.u, places.v, places.footprint_m, coarsest_level, finest_level,
                               seed, NoSlope{}, sum);
}

TERRACAST_PACKET_CODE void sum_all_planes(const NoisePlaces& places, int coarsest_level,
                                          int finest_level, std::uint32_t seed, Lanes<float>& sum) {
  for (int i = 0; i < kLanes; ++i) sum[i] = 0.0f;
  Octave octave;
  for (int level = coarsest_level; level >= finest_level; --level) {
    const int plane = plane_of(level);
    evaluate_octave<false>(places.u[plane], places.v[plane], level, seed, octave);
    for (int i = 0; i < kLanes; ++i) sum[i] += octave.value[i];
  }
  const float scale = scale_of(coarsest_level - finest_level + 1);
  for (int i = 0; i < kLanes; ++i) sum[i] *= scale;
}

TERRACAST_PACKET_CODE void sum_planes_with_slope(const NoisePlaces& places, int coarsest_level,
                                                 int finest_level, std::uint32_t seed,
                                                 const Lanes<float>& slope_weight,
                                                 const Lanes<float>& slope_below_m, NoiseSum& sum,
                                                 NoiseSlope& slope) {
  sum_octaves<kNumNoisePlanes>(places.u, places.v, places.footprint_m, coarsest_level, finest_level,
                               seed, SlopeInPlanes{slope_weight, slope_below_m, slope}, sum);
}

TERRACAST_PACKET_CODE void sum_given(const Lanes<std::int32_t>& u, const Lanes<std::int32_t>& v,
                                     const Lanes<float>& footprint_m, int coarsest_level,
                                     int finest_level, std::uint32_t seed, NoiseSum& sum) {
  sum_octaves<1>(&u, &v, footprint_m, coarsest_level, finest_level, seed, NoSlope{}, sum);
}

TERRACAST_PACKET_CODE void sum_given_with_slope(const Lanes<std::int32_t>& u,
                                                const Lanes<std::int32_t>& v,
                                                const Lanes<float>& footprint_m, int coarsest_level,
                                                int finest_level, std::uint32_t seed,
                                                const Lanes<float>& slope_weight, NoiseSum& sum,
                                                Lanes<float>& slope_u) {
  sum_octaves<1>(&u, &v, footprint_m, coarsest_level, finest_level, seed,
                 SlopeAlongU{slope_weight, slope_u}, sum);
}

}  // namespace

const std::array<NoisePlane, kNumNoisePlanes>& noise_planes() {
  // Turned by 0, 37 and 73 degrees; the shears point 60 degrees apart. A slope of 1 / kShear along a
  // shear has a plane whose texture is drawn out without end: it is one that only crags have.
  constexpr double kShear = 0.5;
  static const std::array<NoisePlane, kNumNoisePlanes> planes = [] {
    std::array<NoisePlane, kNumNoisePlanes> made;
    const double turns_deg[kNumNoisePlanes] = {0.0, 37.0, 73.0};
    const double shears_deg[kNumNoisePlanes] = {20.0, 80.0, 140.0};
    for (std::size_t i = 0; i < kNumNoisePlanes; ++i) {
      const double turn = turns_deg[i] * 0.017453292519943295;
      const double shear = shears_deg[i] * 0.017453292519943295;
      made[i].u = {std::cos(turn), std::sin(turn), kShear * std::cos(shear)};
      made[i].v = {-std::sin(turn), std::cos(turn), kShear * std::sin(shear)};
    }
    return made;
  }();
  return planes;
}

void NoisePlaces::set(const Lanes3d& points_world, const Lanes<double>& footprints_m) {
  const std::array<NoisePlane, kNumNoisePlanes>& planes = noise_planes();
  for (std::size_t plane = 0; plane < kNumNoisePlanes; ++plane) {
    find_coordinates(points_world, planes[plane].u.data(), u[plane]);
    find_coordinates(points_world, planes[plane].v.data(), v[plane]);
  }
  for (int i = 0; i < kLanes; ++i) footprint_m[i] = static_cast<float>(footprints_m[i]);
}

NoiseSum sum_noise(const NoisePlaces& places, int coarsest_level, int finest_level,
                   std::uint32_t seed) {
  NoiseSum sum;
  sum_planes(places, coarsest_level, finest_level, seed, sum);
  return sum;
}

Lanes<float> sum_all_noise(const NoisePlaces& places, int coarsest_level, int finest_level,
                           std::uint32_t seed) {
  Lanes<float> sum;
  sum_all_planes(places, coarsest_level, finest_level, seed, sum);
  return sum;
}

NoiseSum sum_noise_with_slope(const NoisePlaces& places, int coarsest_level, int finest_level,
                              std::uint32_t seed, const Lanes<float>& slope_weight,
                              const Lanes<float>& slope_below_m, NoiseSlope& slope) {
  NoiseSum sum;
  sum_planes_with_slope(places, coarsest_level, finest_level, seed, slope_weight, slope_below_m,
                        sum, slope);
  return sum;
}

NoiseSum sum_noise_at(const Lanes<std::int32_t>& u, const Lanes<std::int32_t>& v,
                      const Lanes<float>& footprint_m, int coarsest_level, int finest_level,
                      std::uint32_t seed) {
  NoiseSum sum;
  sum_given(u, v, footprint_m, coarsest_level, finest_level, seed, sum);
  return sum;
}

NoiseSum sum_noise_at_with_slope(const Lanes<std::int32_t>& u, const Lanes<std::int32_t>& v,
                                 const Lanes<float>& footprint_m, int coarsest_level,
                                 int finest_level, std::uint32_t seed,
                                 const Lanes<float>& slope_weight, Lanes<float>& slope_u) {
  NoiseSum sum;
  sum_given_with_slope(u, v, footprint_m, coarsest_level, finest_level, seed, slope_weight, sum,
                       slope_u);
  return sum;
}

}  // namespace terracast::core
