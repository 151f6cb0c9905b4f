#include "scene/objects/object_shading.h"

#include <algorithm>
#include <cmath>

#include "geo/sun.h"
#include "scene/light/shading.h"

namespace terracast::scene {
namespace {

constexpr float kPi = 3.14159265f;

Color color_of(const Rgb& rgb) { return {rgb.r, rgb.g, rgb.b}; }

/// What a layer shows in the direction of the mirror: the sky, or the ground below the horizon, mixed
/// over the width that its roughness spreads.
Color surroundings(const Eigen::Vector3f& direction, float roughness, const Sky& sky) {
  constexpr float kGroundAlbedo = 0.15f;
  const Eigen::Vector3f up = sky.daylight().up_world.cast<float>();
  const float height = direction.dot(up);
  const float spread = 0.02f + roughness;
  const float above = std::clamp(0.5f + 0.5f * height / spread, 0.0f, 1.0f);
  Color seen = (1.0f - above) * (kGroundAlbedo / kPi) * sky.global_irradiance();
  if (above > 0.0f) {
    // The part of what is mirrored that lies above the horizon.
    const Eigen::Vector3f lifted =
        (direction + std::max(0.5f * spread - height, 0.0f) * up).normalized();
    seen += above * sky.radiance(lifted);
  }
  return seen;
}

/// Trowbridge and Reitz's facets with Smith's shadows (Heitz 2014), over the cosine of the view: a
/// plane's radiance over the irradiance of what faces the sun.
float facets(float cos_half, float cos_view, float cos_sun, float alpha) {
  const float alpha2 = alpha * alpha;
  const float spread = cos_half * cos_half * (alpha2 - 1.0f) + 1.0f;
  const float density = alpha2 / (kPi * spread * spread);
  const float view = cos_sun * std::sqrt(alpha2 + (1.0f - alpha2) * cos_view * cos_view);
  const float sun = cos_view * std::sqrt(alpha2 + (1.0f - alpha2) * cos_sun * cos_sun);
  return density * 0.5f / (view + sun) * cos_sun;
}

}  // namespace

float mirrored_share(float facing, float cosine) {
  const float away = 1.0f - std::clamp(cosine, 0.0f, 1.0f);
  const float squared = away * away;
  return facing + (1.0f - facing) * squared * squared * away;
}

Color object_radiance(const ObjectLook& look, const ObjectLight& light, const Sky& sky) {
  const Eigen::Vector3f sun = sky.daylight().sun_direction_world.cast<float>();
  const float open =
      look.openness * (light.sky_share >= 0.0f ? light.sky_share : look.crown_openness);
  const Color sun_irradiance = sky.sun_irradiance() * light.sun_share;
  const float cos_sun = look.normal.dot(sun);
  const ObjectLook::Gloss& gloss = look.gloss;
  // What a layer mirrors of the sun does not come to what lies below it.
  const Color mirrored_sun = gloss.share * Color(mirrored_share(gloss.facing.r, std::abs(cos_sun)),
                                                 mirrored_share(gloss.facing.g, std::abs(cos_sun)),
                                                 mirrored_share(gloss.facing.b, std::abs(cos_sun)));
  const Color sun_below = sun_irradiance * (1.0f - mirrored_sun);

  const auto around = [&](const Eigen::Vector3f& normal) -> Color {
    return sky.ambient().irradiance(normal) * open +
           sky.global_irradiance() * (kBouncedShare * (1.0f - open));
  };
  Color leaving =
      color_of(look.albedo) * (sun_below * std::max(cos_sun, 0.0f) + around(look.normal)) / kPi;
  if (look.transmitted.g > 0.0f)
    leaving += color_of(look.transmitted) *
               (sun_below * std::max(-cos_sun, 0.0f) + around(-look.normal)) / kPi;

  if (gloss.share > 0.0f) {
    const float cos_view = std::max(gloss.normal.dot(light.to_camera), 0.03f);
    // Rough layers mirror less at grazing angles: facets turned to the camera are steeper.
    const float seen = std::min(cos_view + 0.5f * gloss.roughness, 1.0f);
    const Color reflected = gloss.share * Color(mirrored_share(gloss.facing.r, seen),
                                                mirrored_share(gloss.facing.g, seen),
                                                mirrored_share(gloss.facing.b, seen));
    const Eigen::Vector3f mirrored = 2.0f * cos_view * gloss.normal - light.to_camera;
    leaving = leaving * (1.0f - reflected) +
              reflected * open * surroundings(mirrored.normalized(), gloss.roughness, sky);
    const float cos_gloss_sun = gloss.normal.dot(sun);
    if (light.sun_share > 0.0f && cos_gloss_sun > 0.0f) {
      const Eigen::Vector3f half = (sun + light.to_camera).normalized();
      const float cos_half = std::clamp(half.dot(gloss.normal), 0.0f, 1.0f);
      const auto disc = static_cast<float>(geo::kSunAngularRadius_rad);
      const float alpha = std::sqrt(gloss.roughness * gloss.roughness + 4.0f * disc * disc);
      const float lobe = facets(cos_half, cos_view, cos_gloss_sun, alpha);
      const float cos_facet = half.dot(sun);
      leaving += gloss.share *
                 Color(mirrored_share(gloss.facing.r, cos_facet),
                       mirrored_share(gloss.facing.g, cos_facet),
                       mirrored_share(gloss.facing.b, cos_facet)) *
                 sun_irradiance * lobe;
    }
  }
  if (look.emitted_by_night.r > 0.0f) {
    // Lights go on while the sun sets.
    const auto elevation =
        static_cast<float>(sky.daylight().sun_direction_world.dot(sky.daylight().up_world));
    leaving += color_of(look.emitted_by_night) * ramp(0.5f - elevation / 0.06f);
  }
  return leaving;
}

}  // namespace terracast::scene
