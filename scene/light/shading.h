#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "scene/ground/ground.h"
#include "scene/ground/lanes.h"
#include "scene/light/sky.h"

namespace terracast::scene {

/// How a packet of ground places is seen.
struct ViewPacket {
  Lanes3f direction;  ///< unit, from the camera to the place, world
  Lanes<float> distance_m;
  Lanes<float> sun_share;  ///< of the sun's disc that is seen from the place, 0 … 1
  Lanes<float>
      sky_share;  ///< of the light of the surroundings what comes past objects near by, 0 … 1
  /// Of water: radiance from below and what it mirrors; red below 0: its albedo, and the sky.
  Lanes3f below;
  Lanes3f mirrored;
  Lanes<float> reflectance;     ///< of the facet that is met; below 0: nobody has looked
  Lanes<float> start_height_m;  ///< of where the ray starts, above sea level, for the air between
};

/// Where the sky is hidden by things near by, what comes from these instead: a share of the irradiance of
/// level ground in the open. Half of it stands in the shade itself, and it sends on a tenth.
inline constexpr float kBouncedShare = 0.05f;

/// Radiance of a Lambertian surface: albedo / pi times the irradiance by sun and surroundings. In a
/// white furnace (uniform surroundings, albedo 1) it is the furnace's. sun_irradiance   of a plane
/// that faces the sun, what is shadowed left out ambient          irradiance of the surface's plane
/// by all but the sun
Color lambert_radiance(const Color& albedo, float cos_sun, const Color& sun_irradiance,
                       const Color& ambient);

/// Share of light that a smooth water surface reflects (Schlick's fit of Fresnel's formula for n
/// = 1.333).
float water_reflectance(float cos_incidence);

/// Radiance that leaves the places of a packet towards the camera and reaches it through the air.
/// Threads: safe.
void shade_ground(const GroundPacket& places, const GroundLook& look, const ViewPacket& view,
                  const Sky& sky, Lanes3f& radiance);

/// Radiance of the sky with the sun's disc in a unit direction.
Color shade_sky(const Sky& sky, const Eigen::Vector3d& direction_world);

/// From radiance to pixel values: an exposure and a white balance fixed by the sequence's light,
/// then a curve that is linear up to 0.5 and bends to 1 (a film's shoulder), then the transfer
/// function of sRGB (IEC 61966-2-1).
class Exposure {
 public:
  /// bias   factor on the exposure that puts a sunlit level grey of 18 % at 0.24 of white
  Exposure(const Sky& sky, double bias);
  void develop(const Color& radiance, std::uint8_t* rgb) const;

  /// What radiance is multiplied by: the exposure, and the gains of the white balance, which leave the
  /// luminance of the sequence's light.
  float level() const { return level_; }
  const Color& balance() const { return balance_; }
  const Color& scale() const { return scale_; }

 private:
  float level_;
  Color balance_;
  Color scale_;
};

/// The shoulder, and sRGB's transfer function of a linear value of [0, 1].
float film_curve(float exposed);
float srgb_from_linear(float linear);

}  // namespace terracast::scene
