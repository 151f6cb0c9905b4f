#include <cmath>

#include "scene/ground/pattern.h"
#include "scene/objects/looks/families.h"

namespace terracast::scene {
namespace {

using world::Material;

/// Dust and road dirt: more near the ground.
float dirt_of(const ObjectPlace& place) {
  return ramp(1.0f - place.from_place_m.z() / 0.9f) * (0.3f + 0.5f * object_tint(place, 3));
}

}  // namespace

void look_at_ware(const ObjectPlace& place, ObjectLook& look) {
  Rgb color = place.color;
  switch (place.finish.material) {
    case Material::Paint: {
      shade(color, 0.92f + 0.16f * object_tint(place, 1));
      const float dirt = dirt_of(place);
      lay(color, 0.30f * dirt, 0.130f, 0.115f, 0.092f);
      look.gloss.share = 1.0f - 0.6f * dirt;
      look.gloss.roughness = 0.07f + 0.15f * dirt;
      break;
    }
    case Material::Glass:
      // What is seen through it is dark; tinted by the finish.
      shade(color, 0.25f);
      look.gloss.share = 0.97f;
      look.gloss.facing = {0.06f, 0.06f, 0.06f};
      look.gloss.roughness = 0.03f;
      break;
    case Material::Rubber:
      lay(color, 0.30f * ramp(1.0f - place.from_place_m.z() / 0.5f), 0.100f, 0.088f, 0.070f);
      look.gloss.share = 0.5f;
      look.gloss.roughness = 0.5f;
      break;
    case Material::Metal: {
      // Weathered: part of it mirrors, in the metal's own colour, part is oxide.
      shade(color, 1.0f + 0.06f * place.coarse + 0.05f * place.fine);
      const float clean = clamped(0.45f + 0.12f * place.coarse, 0.2f, 0.7f);
      look.gloss.share = clean;
      look.gloss.facing = {clamped(0.3f + color.r, 0.05f, 0.9f),
                           clamped(0.3f + color.g, 0.05f, 0.9f),
                           clamped(0.3f + color.b, 0.05f, 0.9f)};
      look.gloss.roughness = 0.32f;
      shade(color, 0.8f);
      break;
    }
    default:  // Lamp
      look.gloss.share = 0.8f;
      look.gloss.roughness = 0.15f;
      look.emitted_by_night = {4.0f * color.r + 0.4f, 4.0f * color.g + 0.3f, 4.0f * color.b + 0.2f};
      break;
  }
  look.albedo = color;
}

}  // namespace terracast::scene
