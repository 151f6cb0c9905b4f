#pragma once

#include <cstdint>

#include "scene/ground/ground.h"
#include "scene/ground/natural_cover.h"
#include "scene/ground/noise.h"

/// How snowfields and glaciers look.
namespace terracast::scene {

/// Noise of snow and ice.
struct SnowNoise {
  NoiseSum drifts;     ///< of snow that the wind carves, 2 m to 1/8 m across it
  NoiseSum bands;      ///< of ice, between which debris lies, 16 to 2 m across them
  NoiseSum crevasses;  ///< of ice that flows over steep ground
};

/// Adds up the noise, and the slopes of drifts to `slope`.
SnowNoise sum_snow_noise(const GroundPacket& packet, const Covers& covers, const Climate& climate,
                         NoiseSlope& slope);

/// Albedo of snow and ice at a packet's places, red, green, blue.
///
/// Snow is bright where it stays fresh, high above its line, and grey with age near it and below. Ice that a
/// source maps below the line is a glacier's, bare in summer: blue-grey, in bands with debris between them,
/// more of it the farther down; with crevasses across steep ground.
void paint_snow(const GroundPacket& packet, const Covers& covers, const SnowNoise& noise,
                const Climate& climate, Lanes<float> (&albedo)[3]);

}  // namespace terracast::scene
