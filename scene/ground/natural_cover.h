#pragma once

#include <cstdint>

#include "core/packet_code.h"
#include "scene/ground/ground.h"
#include "scene/ground/noise.h"

/// What covers unpaved land, and how it looks.
namespace terracast::scene {

/// Streams of noise; each idea has its own.
inline constexpr std::uint32_t kRegion = 11;
inline constexpr std::uint32_t kPatch = 23;
inline constexpr std::uint32_t kClump = 37;
inline constexpr std::uint32_t kTrees = 41;
inline constexpr std::uint32_t kCoarseGrain = 53;
inline constexpr std::uint32_t kGrain = 67;
inline constexpr std::uint32_t kFineGrain = 79;
inline constexpr std::uint32_t kStrata = 83;
inline constexpr std::uint32_t kCracks = 97;
inline constexpr std::uint32_t kStones = 101;
inline constexpr std::uint32_t kWaves = 113;
inline constexpr std::uint32_t kBushes = 131;
inline constexpr std::uint32_t kFormations = 139;

/// Shares of the ground's covers at a packet, each over all that is listed before it.
struct Covers {
  Lanes<float> grass;
  Lanes<float> field;
  Lanes<float> forest;
  Lanes<float> sand;
  Lanes<float> scree;
  Lanes<float> rock;
  Lanes<float> snow;
  // What a source of land cover tells beside: all 0 where none knows.
  Lanes<float> shrubs;
  Lanes<float> floor;  ///< of forests whose trees stand on it
  Lanes<float> meadow;
  Lanes<float> built;
  Lanes<float> wet;
  NoiseSum region;  ///< 4 km to 256 m
  NoiseSum patch;   ///< 128 to 32 m
  NoiseSum clump;   ///< 16 to 1 m
};

/// Sets the shares by slope, height, moisture and noise; the noise sums are set.
void guess_covers(const GroundPacket& packet, const Climate& climate, Covers& covers);

/// Guesses at all lanes.
/// sum   sum_noise for what samples see, sum_all_noise for what is at their points
template <class Sum>
void spread_covers(const GroundPacket& packet, const Climate& climate, const Sum& sum,
                   Covers& covers) {
  covers.region = sum(packet.places, 12, 8, climate.seed + kRegion);
  covers.patch = sum(packet.places, 7, 5, climate.seed + kPatch);
  covers.clump = sum(packet.places, 4, 0, climate.seed + kClump);
  guess_covers(packet, climate, covers);
}

/// Puts what a source tells of the cover in the place of the guess; what lies bare keeps the guess of its kind.
void take_known_covers(const GroundPacket& packet, const Climate& climate, Covers& covers);

/// How clearly rock shows its beds, 0 … 1: massive in one region, banded in another.
TERRACAST_PACKET_INLINE float bedding_of(float region) {
  return core::smaller(core::larger(0.5f + 0.6f * region, 0.0f), 1.0f);
}

/// Share of what gathers and runs down that a place has, 0 on ribs, 1 in gullies: the land's wetness is a
/// matter of how much lies above a place.
/// moisture   0 … 1
TERRACAST_PACKET_INLINE float gully_of(float moisture) {
  return core::smaller(core::larger(10.0f * (moisture - 0.085f), 0.0f), 1.0f);
}

/// What the covers are painted with.
struct Details {
  const NoiseSum& coarse;
  const NoiseSum& grain;
  const NoiseSum& fine;
  const NoiseSum& stones;
  const NoiseSum& trees;
  const NoiseSum& formation;  ///< of rock: beds of 512 to 128 m
  const NoiseSum& strata;     ///< beds of 64 to 2 m
  const NoiseSum& cracks;
  const NoiseSum& bushes;
  const Lanes<float> (&snow)[3];  ///< its albedo, red, green, blue
};

/// Albedo and openness of dry land.
/// relief   slope of each octave of small relief
void paint_land(const GroundPacket& packet, const Covers& covers, const Details& details,
                const Lanes<float>& relief, const Climate& climate, GroundLook& look);

}  // namespace terracast::scene
