#include "scene/light/shading.h"

#include <algorithm>
#include <cmath>

#include "geo/sun.h"

namespace terracast::scene {
namespace {

constexpr float kPi = 3.14159265f;

Eigen::Vector3f lane_vector(const Lanes3f& lanes, int lane) {
  return {lanes[0][lane], lanes[1][lane], lanes[2][lane]};
}

Color color_of(const Lanes3f& lanes, int lane) {
  return {lanes[0][lane], lanes[1][lane], lanes[2][lane]};
}

/// Water: the sky mirrored by the waves that are drawn, the sun's glitter by the spread of those
/// that are not (facets with Gaussian slopes, Cox and Munk 1954), and the light that comes back
/// from below.
Color water_radiance(const GroundLook& look, const ViewPacket& view, const Sky& sky,
                     const Eigen::Vector3f& sun, int lane, const Color& from_below) {
  const Eigen::Vector3f normal = lane_vector(look.normal, lane);
  const Eigen::Vector3f to_camera = -lane_vector(view.direction, lane);
  const float cos_view = std::max(normal.dot(to_camera), 0.02f);
  // Rough water mirrors less at grazing angles: facets turned to the camera are steeper.
  const float spread = std::sqrt(look.wave_variance[lane]);
  const float reflectance = view.reflectance[lane] >= 0.0f
                                ? view.reflectance[lane]
                                : water_reflectance(std::min(cos_view + 0.6f * spread, 1.0f));

  Eigen::Vector3f mirrored = 2.0f * normal.dot(to_camera) * normal - to_camera;
  const Eigen::Vector3f up = sky.daylight().up_world.cast<float>();
  const float below = 0.02f + spread - mirrored.dot(up);
  if (below > 0.0f) mirrored += below * up;
  mirrored.normalize();
  const Color seen_above =
      view.mirrored[0][lane] >= 0.0f ? color_of(view.mirrored, lane) : sky.radiance(mirrored);
  Color radiance = reflectance * seen_above +
                   (1.0f - reflectance) *
                       (view.below[0][lane] >= 0.0f ? color_of(view.below, lane) : from_below);

  const Eigen::Vector3f half = (sun + to_camera).normalized();
  const float cos_tilt = half.dot(normal);
  if (cos_tilt > 0.0f && view.sun_share[lane] > 0.0f) {
    const float variance =
        look.wave_variance[lane] +
        static_cast<float>(geo::kSunAngularRadius_rad * geo::kSunAngularRadius_rad);
    const float cos2 = cos_tilt * cos_tilt;
    const float slopes = std::exp(-(1.0f - cos2) / (cos2 * variance)) / (kPi * variance);
    const float facet = slopes / (4.0f * cos_view * cos2 * cos2);
    radiance += sky.sun_irradiance() *
                (view.sun_share[lane] * facet * water_reflectance(std::max(half.dot(sun), 0.0f)));
  }
  return radiance;
}

}  // namespace

Color lambert_radiance(const Color& albedo, float cos_sun, const Color& sun_irradiance,
                       const Color& ambient) {
  return albedo * (1.0f / kPi) * (sun_irradiance * std::max(cos_sun, 0.0f) + ambient);
}

float water_reflectance(float cos_incidence) {
  const float away = 1.0f - cos_incidence;
  const float squared = away * away;
  return 0.0204f + 0.9796f * squared * squared * away;
}

void shade_ground(const GroundPacket& places, const GroundLook& look, const ViewPacket& view,
                  const Sky& sky, Lanes3f& radiance) {
  const Eigen::Vector3f sun = sky.daylight().sun_direction_world.cast<float>();
  for (int i = 0; i < kLanes; ++i) {
    const Eigen::Vector3f normal = lane_vector(look.normal, i);
    const Color albedo(look.albedo[0][i], look.albedo[1][i], look.albedo[2][i]);
    const float open = view.sky_share[i];
    // What hides the sky sends on some of the light that comes to it.
    const Color ambient = sky.ambient().irradiance(normal) * (look.openness[i] * open) +
                          sky.global_irradiance() * (kBouncedShare * (1.0f - open));
    Color leaving = lambert_radiance(albedo, normal.dot(sun),
                                     sky.sun_irradiance() * view.sun_share[i], ambient);
    if (look.is_water[i] > 0.0f) leaving = water_radiance(look, view, sky, sun, i, leaving);
    const float cos_sun = lane_vector(view.direction, i).dot(sun);
    const AirPath air =
        sky.air(view.distance_m[i], view.start_height_m[i], places.height_m[i], cos_sun);
    const Color seen = leaving * air.transmittance + air.inscatter;
    for (int k = 0; k < 3; ++k) radiance[static_cast<std::size_t>(k)][i] = seen[k];
  }
}

Color shade_sky(const Sky& sky, const Eigen::Vector3d& direction_world) {
  Color color = sky.radiance(direction_world.cast<float>());
  const Eigen::Vector3d& sun = sky.daylight().sun_direction_world;
  // By the chord, which is exact in double where the cosine is not.
  if ((direction_world - sun).norm() < 2.0 * std::sin(0.5 * geo::kSunAngularRadius_rad))
    color += sky.sun_radiance();
  return color;
}

Exposure::Exposure(const Sky& sky, double bias) {
  // Metered by level ground, but by what faces a low sun where that is brighter. Night stays dark:
  // below 2 klx the camera opens no further.
  const float facing =
      luminance_of(sky.sun_irradiance() + sky.ambient().irradiance(Eigen::Vector3f::UnitZ()));
  const float light = std::max({luminance_of(sky.global_irradiance()), 0.6f * facing, 2.0f});
  // White is what a level white board shows: the colour of sun and sky together, at most 2 to 1
  // against the light.
  const Color tint =
      (sky.global_irradiance() / luminance_of(sky.global_irradiance() + 1e-6f)).max(0.5f).min(2.0f);
  level_ = static_cast<float>(bias) * 0.24f * kPi / (0.18f * light);
  balance_ = 1.0f / tint;
  scale_ = level_ / tint;
}

float film_curve(float exposed) {
  constexpr float kKnee = 0.5f;
  if (exposed <= kKnee) return std::max(exposed, 0.0f);
  const float over = (exposed - kKnee) / (1.0f - kKnee);
  return kKnee + (1.0f - kKnee) * over / (1.0f + over);
}

float srgb_from_linear(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

void Exposure::develop(const Color& radiance, std::uint8_t* rgb) const {
  for (int k = 0; k < 3; ++k) {
    const float value = srgb_from_linear(film_curve(radiance[k] * scale_[k]));
    rgb[k] = static_cast<std::uint8_t>(std::clamp(255.0f * value + 0.5f, 0.0f, 255.0f));
  }
}

}  // namespace terracast::scene
