#pragma once

#include <cstdint>

#include "core/lanes.h"
#include "core/packet_code.h"

/// What covers the bed of the sea: one law for what is painted there (scene/water/water.cpp) and for what stands there
/// (tiler/vegetation/sea_bed_plants.cpp). Noise of the place decides it, the sea's depth and how steep the bed is.
///
/// source    Posidonia oceanica grows from about a metre below the surface down to where a tenth of the
///           light is left (Duarte 1991, "Seagrass depth limits", Aquatic Botany 40): here it fades from
///           26 to 38 m
/// versions  no hash holds what decides here: who changes it raises kVegetationVersion
///           (tiler/layers/vegetation.cpp) and kRenderVersion (render/input_hash.cpp), both, or worlds
///           keep the plants and captures the paint of before
/// threads   safe
namespace terracast::world::sea_bed {

/// Octaves of core::sum_noise(): of lattices of 2^coarsest_level … 2^finest_level m, of the world's seed plus `stream`.
struct Band {
  int coarsest_level;
  int finest_level;
  std::uint32_t stream;
};
inline constexpr Band kPatch{6, 3, 401};
/// None is narrower than a tuft of plants: a meadow has tufts all over, and its border follows them.
inline constexpr Band kWeed{6, 3, 409};

/// The seed of the noise of all ground (scene::Climate), of the world's.
std::uint32_t noise_seed(std::uint64_t world_seed);

/// 0 below -width, 1 above width, smooth between.
TERRACAST_PACKET_INLINE float risen(float x, float width) {
  const float t = core::smaller(core::larger(0.5f + 0.5f * x / width, 0.0f), 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

/// Share of the bed that seagrass covers, 0 … 1; plants stand where it is above kStands.
/// patch, weed   of the bands
/// depth_m       of the sea above; 0 where other water or none is
/// steepness     sine of the bed's slope: no matte holds where it is above 0.27
/// soft          root mean square of what a footprint left out of the noise
TERRACAST_PACKET_INLINE float seagrass(float patch, float weed, float depth_m, float steepness,
                                       float soft) {
  const float in_light = risen(depth_m - 1.3f, 0.4f) * risen(32.0f - depth_m, 6.0f);
  const float held = risen(0.22f - steepness, 0.05f);
  return in_light * held * risen(weed + 0.7f * patch - 0.35f, 0.2f + soft);
}
inline constexpr float kStands = 0.5f;

/// Share that bare rock covers: where it is steep, and in hollows of the patches.
/// steepness   sine of the slope
TERRACAST_PACKET_INLINE float rock(float patch, float steepness, float soft) {
  return risen(5.0f * steepness - 0.8f * patch - 1.8f, 0.6f + soft);
}

/// Noise of places on the bed.
struct Noise {
  core::Lanes<float> patch;
  core::Lanes<float> weed;
};
/// points_world   on the bed
/// seed           noise_seed()
Noise noise_at(const core::Lanes3d& points_world, std::uint32_t seed);

}  // namespace terracast::world::sea_bed
