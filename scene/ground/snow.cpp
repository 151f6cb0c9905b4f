#include "scene/ground/snow.h"

#include "core/packet_code.h"
#include "scene/ground/blend.h"

namespace terracast::scene {
namespace {

using core::smaller;
using world::Cover;

/// Drifts are four times as long as they are wide. Crevasses come from noise that is finer across the bands of
/// the ice and along them.
constexpr int kDriftStretch_log2 = 2;
constexpr std::uint32_t kCrevasseScale = 4;
constexpr std::uint32_t kCrevasseStretch = 6;

/// Streams of noise beside those of natural_cover.h.
constexpr std::uint32_t kDrifts = 149;
constexpr std::uint32_t kIceBands = 157;
constexpr std::uint32_t kCrevasses = 163;

/// Slits open where the noise passes zero; of noise of RMS 1 that is, in the mean, its density at zero over
/// this number.
constexpr float kSlitsOverRms = 7.0f;
constexpr float kMeanSlit = 0.39894f / kSlitsOverRms;

TERRACAST_PACKET_INLINE float mix(float a, float b, float share) { return a + share * (b - a); }

std::int32_t times(std::int32_t steps, std::uint32_t factor) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(steps) * factor);
}

/// How much of a place is bare ice of a glacier, 0 … 1, and how far it lies below the snow line.
struct Ice {
  float share;
  float below_m;
};
TERRACAST_PACKET_INLINE Ice ice_at(const GroundPacket& g, const Covers& c, int i, float snow_line_m,
                                   bool has_mapped_ice) {
  const bool is_mapped = has_mapped_ice && static_cast<Cover>(g.cover[i]) == Cover::Snow;
  const float below_m = snow_line_m - g.height_m[i];
  const float edge = below_m / 120.0f + 0.5f * c.region.value[i] + 0.5f * c.patch.value[i] +
                     0.3f * c.clump.value[i];
  const float share = step_up(edge, 0.5f + 0.5f * c.patch.left_out[i] + 0.3f * c.clump.left_out[i]);
  return {is_mapped ? share : 0.0f, below_m};
}

/// Coordinates of ice: across its bands, which folds bend, and along them; those of crevasses are finer.
TERRACAST_PACKET_CODE void place_ice(const GroundPacket& g, const Covers& c,
                                     Lanes<std::int32_t>& across, Lanes<std::int32_t>& crevasse_u,
                                     Lanes<std::int32_t>& crevasse_v) {
  constexpr float kStepsPerMetre = 1.0f / static_cast<float>(kNoiseStep_m);
  for (int i = 0; i < kLanes; ++i) {
    const float bent_m =
        12.0f * c.region.value[i] + 3.0f * c.patch.value[i] + 0.4f * c.clump.value[i];
    across[i] = g.strata_u[i] + static_cast<std::int32_t>(bent_m * kStepsPerMetre);
    crevasse_u[i] = times(across[i], kCrevasseScale);
    crevasse_v[i] = times(g.strata_v[i], kCrevasseStretch);
  }
}

/// Slopes of drifts, of which bare ice has none.
TERRACAST_PACKET_CODE void weigh_drifts(const GroundPacket& g, const Covers& c, float snow_line_m,
                                        bool has_mapped_ice, Lanes<float>& steepness) {
  for (int i = 0; i < kLanes; ++i)
    steepness[i] = 0.09f * c.snow[i] * (1.0f - ice_at(g, c, i, snow_line_m, has_mapped_ice).share);
}

TERRACAST_PACKET_CODE void paint(const GroundPacket& g, const Covers& c, const SnowNoise& n,
                                 float snow_line_m, bool has_mapped_ice, Lanes<float>& red,
                                 Lanes<float>& green, Lanes<float>& blue) {
  for (int i = 0; i < kLanes; ++i) {
    const Ice ice = ice_at(g, c, i, snow_line_m, has_mapped_ice);
    const float patch = c.patch.value[i];
    // Fresh far above the line; old, dusty and coarse by it and below.
    Rgb color{0.800f, 0.815f, 0.840f};
    lay(color, ramp(0.5f + 0.0016f * ice.below_m + 0.15f * c.region.value[i] + 0.10f * patch),
        0.640f, 0.660f, 0.700f);
    shade(color, 1.0f + 0.030f * n.drifts.value[i] + 0.020f * patch);

    // Bubbly ice, pale and blue by turns, and debris that melts out of it.
    const float band = n.bands.value[i];
    const float lost = n.bands.left_out[i];
    Rgb bare{0.400f, 0.465f, 0.530f};
    lay(bare, 0.6f * step_up(band - 0.3f, 0.5f + lost), 0.540f, 0.585f, 0.625f);
    lay(bare, 0.5f * step_up(-band - 0.6f, 0.4f + lost), 0.235f, 0.335f, 0.430f);
    const float debris =
        ramp(ice.below_m / 900.0f) *
        step_up(0.8f * c.clump.value[i] + 0.6f * patch - 0.7f * band - 0.2f,
                0.6f + 0.8f * c.clump.left_out[i] + 0.6f * c.patch.left_out[i] + 0.7f * lost);
    lay(bare, 0.8f * debris, 0.215f, 0.200f, 0.180f);
    lay(color, ice.share, bare);

    // Crevasses: narrow slits with blue walls, across the slope.
    const float open =
        ramp((g.steepness[i] - 0.12f) * 10.0f) * (1.0f - ramp((g.steepness[i] - 0.55f) * 8.0f));
    const float slit = mix(1.0f - smaller(absolute(n.crevasses.value[i]) * kSlitsOverRms, 1.0f),
                           kMeanSlit, n.crevasses.left_out[i]);
    lay(color, 0.85f * ice.share * open * slit, 0.070f, 0.130f, 0.185f);
    red[i] = color.r;
    green[i] = color.g;
    blue[i] = color.b;
  }
}

}  // namespace

SnowNoise sum_snow_noise(const GroundPacket& packet, const Covers& covers, const Climate& climate,
                         NoiseSlope& slope) {
  // The wind blows along the first plane's v; drifts rise and fall across it.
  Lanes<std::int32_t> along_wind, across_ice, crevasse_u, crevasse_v;
  Lanes<float> steepness;
  for (int i = 0; i < kLanes; ++i) along_wind[i] = packet.places.v[0][i] >> kDriftStretch_log2;
  weigh_drifts(packet, covers, static_cast<float>(climate.snow_line_m), climate.has_mapped_ice,
               steepness);
  place_ice(packet, covers, across_ice, crevasse_u, crevasse_v);
  const Lanes<float>& footprint_m = packet.places.footprint_m;
  return {.drifts = sum_noise_at_with_slope(packet.places.u[0], along_wind, footprint_m, 1, -3,
                                            climate.seed + kDrifts, steepness, slope.u[0]),
          .bands = sum_noise_at(across_ice, packet.strata_v, footprint_m, 4, 1,
                                climate.seed + kIceBands),
          .crevasses =
              sum_noise_at(crevasse_u, crevasse_v, footprint_m, 4, 3, climate.seed + kCrevasses)};
}

void paint_snow(const GroundPacket& packet, const Covers& covers, const SnowNoise& noise,
                const Climate& climate, Lanes<float> (&albedo)[3]) {
  paint(packet, covers, noise, static_cast<float>(climate.snow_line_m), climate.has_mapped_ice,
        albedo[0], albedo[1], albedo[2]);
}

}  // namespace terracast::scene
