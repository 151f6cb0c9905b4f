#include "scene/water/water.h"

#include "scene/ground/blend.h"
#include "scene/ground/natural_cover.h"
#include "scene/ground/relief.h"
#include "world/sea_bed.h"

namespace terracast::scene {
namespace {

using core::larger;
using world::Cover;

/// Waves of a water: wind over a short fetch raises short ones.
struct Waves {
  float slope;            ///< of each octave, along each of two axes
  float ripple_variance;  ///< of the slopes of ripples below them all, along both together
  float longest_m;        ///< octave; the shortest is that of 2^kShortestWave m
  float num_octaves;
};
constexpr int kLongestWave = 6;
constexpr int kShortestWave = -3;
constexpr auto kMostOctaves = static_cast<float>(kLongestWave - kShortestWave + 1);

Waves waves_of(Cover cover) {
  if (cover == Cover::Lake) return {0.018f, 0.0008f, 4.0f, 6.0f};
  if (cover == Cover::River) return {0.025f, 0.0008f, 2.0f, 5.0f};
  return {0.035f, 0.003f, 64.0f, kMostOctaves};
}

/// Light that the water sends back, as an albedo: clear, green with algae, brown with silt.
Rgb body_of(Cover cover) {
  if (cover == Cover::Lake) return {0.011f, 0.030f, 0.029f};
  if (cover == Cover::River) return {0.028f, 0.036f, 0.022f};
  return {0.010f, 0.032f, 0.040f};
}

}  // namespace

void look_at_water(const GroundPacket& packet, std::uint32_t seed, GroundLook& look) {
  Lanes<float> weight;
  Lanes<float> below_m;
  for (int i = 0; i < kLanes; ++i) {
    const Waves given = waves_of(static_cast<Cover>(packet.cover[i]));
    weight[i] = given.slope;
    below_m[i] = 2.0f * given.longest_m;
  }
  NoiseSlope slope{};
  const NoiseSum waves = sum_noise_with_slope(packet.places, kLongestWave, kShortestWave,
                                              seed + kWaves, weight, below_m, slope);
  const NoiseSum streaks = sum_noise(packet.places, 11, 3, seed + kPatch);
  GroundLook water;
  bend_normals(packet, slope, water);
  for (int i = 0; i < kLanes; ++i) {
    const auto cover = static_cast<Cover>(packet.cover[i]);
    if (!is_water(cover)) continue;
    for (std::size_t k = 0; k < 3; ++k) look.normal[k][i] = water.normal[k][i];
    const float tone = 1.0f + 0.30f * streaks.value[i];
    // A little foam where steep waves meet, at sea.
    const float foam = cover == Cover::Sea
                           ? 0.10f * step_up(waves.value[i] + 0.8f * streaks.value[i] - 2.4f, 0.5f)
                           : 0.0f;
    const Rgb body = body_of(cover);
    look.albedo[0][i] = body.r * tone + foam;
    look.albedo[1][i] = body.g * tone + foam;
    look.albedo[2][i] = body.b * tone + foam;
    look.openness[i] = 1.0f;
    look.is_water[i] = 1.0f;
    // Waves that are not drawn, of slopes along both axes; the shortest are left out first. Gusts roughen
    // them in patches; in a lull the water lies almost smooth.
    const Waves given = waves_of(cover);
    const float left_out =
        core::smaller(kMostOctaves * waves.left_out[i] * waves.left_out[i], given.num_octaves);
    const float gust = clamped(1.0f + 0.45f * streaks.value[i], 0.3f, 2.0f);
    look.wave_variance[i] =
        gust * (given.ripple_variance + 2.0f * given.slope * given.slope * left_out);
  }
}

void look_at_bed(const GroundPacket& packet, std::uint32_t seed, GroundLook& look) {
  namespace bed = world::sea_bed;
  const auto noise_of = [&](const bed::Band& band) {
    return sum_noise(packet.places, band.coarsest_level, band.finest_level, seed + band.stream);
  };
  const NoiseSum patch = noise_of(bed::kPatch);
  const NoiseSum weed = noise_of(bed::kWeed);
  const NoiseSum film = sum_noise(packet.places, 1, -2, seed + 409);
  const NoiseSum grain = sum_noise(packet.places, 1, -3, seed + 419);
  const NoiseSum fine = sum_noise(packet.places, -2, -6, seed + 421);
  for (int i = 0; i < kLanes; ++i) {
    if (static_cast<Cover>(packet.cover[i]) != Cover::Seabed) continue;
    // Borders are as soft as what the footprint left out of the noise that draws them.
    const float soft = 0.7f * patch.left_out[i] + 0.5f * weed.left_out[i];
    Rgb color{0.245f, 0.200f, 0.138f};  // sand, wet
    shade(color, 1.0f + 0.10f * patch.value[i] + 0.05f * grain.value[i] + 0.05f * fine.value[i]);
    // Gravel and shells lie in patches, rock where it is steep.
    lay(color, 0.55f * step_up(grain.value[i] + 0.5f * patch.value[i] - 1.1f, 0.6f + soft), 0.20f,
        0.18f, 0.15f);
    const float bare_rock = bed::rock(patch.value[i], packet.steepness[i], soft);
    lay(color, bare_rock, 0.105f + 0.03f * grain.value[i], 0.095f + 0.03f * grain.value[i],
        0.080f + 0.025f * grain.value[i]);
    // A film of algae on rock, and on the beds of lakes and rivers.
    const float inland = packet.sea_depth_m[i] > 0.0f ? 0.0f : 1.0f;
    lay(color,
        0.6f * larger(bare_rock, inland) *
            step_up(film.value[i] + 0.7f * patch.value[i] - 0.4f, 0.4f + soft),
        0.050f + 0.010f * fine.value[i], 0.060f + 0.012f * fine.value[i], 0.028f);
    // Below its blades lie shade, sheaths and what they drop.
    const float grown = bed::seagrass(patch.value[i], weed.value[i], packet.sea_depth_m[i],
                                      packet.steepness[i], soft);
    lay(color, 0.9f * grown, 0.030f + 0.008f * fine.value[i], 0.040f + 0.010f * fine.value[i],
        0.016f);
    look.albedo[0][i] = clamped(color.r, 0.01f, 0.7f);
    look.albedo[1][i] = clamped(color.g, 0.01f, 0.7f);
    look.albedo[2][i] = clamped(color.b, 0.005f, 0.7f);
    look.openness[i] = 0.95f - 0.15f * grown;
    look.is_water[i] = 0.0f;
    look.wave_variance[i] = 0.0f;
  }
}

}  // namespace terracast::scene
