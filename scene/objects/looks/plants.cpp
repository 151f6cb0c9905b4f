#include <cmath>

#include "scene/ground/pattern.h"
#include "scene/objects/looks/families.h"

namespace terracast::scene {
namespace {

using world::Material;

/// How far out in its crown a place is: 0 in the middle, 1 at the hull; and the way out.
struct CrownPlace {
  float out;
  Eigen::Vector3f way;
};

CrownPlace crown_place(const ObjectPlace& place) {
  // Crowns begin at about a third of the height; conifers' and broadleaves' alike are then near an
  // ellipsoid about 0.62 of it.
  const float middle_m = 0.62f * place.height_m;
  const float half_m = core::larger(0.40f * place.height_m, 0.05f);
  const float reach_m = core::larger(0.9f * place.reach_m, 0.05f);
  const Eigen::Vector3f from(place.from_place_m.x() / reach_m, place.from_place_m.y() / reach_m,
                             (place.from_place_m.z() - middle_m) / half_m);
  const float out = from.norm();
  const Eigen::Vector3f gradient(from.x() / reach_m, from.y() / reach_m, from.z() / half_m);
  const float length = gradient.norm();
  return {core::smaller(out, 1.0f),
          length > 1e-4f ? Eigen::Vector3f(gradient / length) : Eigen::Vector3f::UnitZ()};
}

/// Of two varieties none has quite the same green.
void tint_plant(const ObjectPlace& place, Rgb& color) {
  const float light = (static_cast<float>(place.variety & 15u) - 7.5f) / 7.5f;
  const float warm = (static_cast<float>(place.variety >> 4) - 7.5f) / 7.5f;
  shade(color, 1.0f + 0.20f * light);
  color.r *= 1.0f + 0.16f * warm;
  color.b *= 1.0f - 0.12f * warm;
}

void look_at_leaves(const ObjectPlace& place, ObjectLook& look) {
  Rgb color = place.color;
  tint_plant(place, color);
  // Leaves of a crown differ among themselves, young ones outside are brighter.
  const bool is_needle = place.finish.material == Material::Needles;
  const float leaf = cell_tint(place.seed, static_cast<double>(place.part / 2), 7.0) - 0.5f;
  shade(color, 1.0f + 0.30f * told(place.footprint_m, 0.6f) * leaf);

  if (place.height_m > 0.0f && place.finish.material != Material::Blades) {
    const CrownPlace crown = crown_place(place);
    // What hangs between a leaf and the sky thins out towards the hull.
    const float within = crown.out * crown.out;
    look.crown_openness = (0.22f + 0.78f * within) * (0.80f + 0.20f * crown.way.z());
    shade(color, 0.86f + 0.20f * within);
    // Large leaves stand for twigs of many, which together face outward.
    const float side = crown.way.dot(place.normal) >= 0.0f ? 1.0f : -1.0f;
    look.normal = (place.normal + side * 0.8f * crown.way).normalized();
  } else {
    // Blades are darker at their foot, where others stand round them.
    const float height =
        place.height_m > 0.0f ? ramp(place.from_place_m.z() / place.height_m) : 1.0f;
    // What stands for many of them far off is as open as they are together.
    const float seen = told(place.footprint_m, core::larger(0.6f * place.height_m, 0.1f));
    const float up = faded(height, 0.8f, seen);
    look.crown_openness = 0.45f + 0.55f * up;
    shade(color, 0.75f + 0.30f * up);
    const Eigen::Vector3f above = Eigen::Vector3f::UnitZ();
    look.normal = (place.normal + (1.7f - 0.5f * seen) * above).normalized();
  }
  // Wax and dust on leaves, and twigs between them, are grey.
  const float grey = (color.r + color.g + color.b) / 3.0f;
  lay(color, 0.16f, grey, grey, grey);
  look.albedo = color;
  // A leaf sends through about as much as back, with less blue and red (Jacquemoud and Baret 1990);
  // needles hardly any.
  const float through = is_needle ? 0.25f : 0.75f;
  look.transmitted = {through * 1.00f * color.r, through * 1.08f * color.g,
                      through * 0.60f * color.b};
  // Wax.
  look.gloss = {.share = is_needle ? 0.3f : 0.6f,
                .facing = {0.04f, 0.04f, 0.04f},
                .roughness = 0.45f,
                .normal = look.normal};
}

void look_at_bark(const ObjectPlace& place, ObjectLook& look) {
  Rgb color = place.color;
  const float grey = (color.r + color.g + color.b) / 3.0f;
  lay(color, 0.30f, grey, grey, grey);
  // Furrows run up the trunk.
  const float furrow =
      told(place.footprint_m, 0.06f) *
      (cell_tint(place.seed, std::floor(place.u_m / 0.03), std::floor(place.v_m / 0.22)) - 0.5f);
  shade(color, 1.0f + 0.5f * furrow + 0.14f * place.fine + 0.08f * place.coarse);
  // Moss and algae at the foot.
  const float foot = ramp(1.0f - place.from_place_m.z() / 1.2f);
  lay(color, 0.35f * foot * ramp(0.5f + 0.5f * place.fine), 0.060f, 0.072f, 0.028f);
  look.albedo = color;
  look.openness = clamped(0.88f + 0.25f * furrow, 0.5f, 1.0f);
  if (place.height_m > 0.0f) look.crown_openness = 0.55f;
}

}  // namespace

void look_at_plant(const ObjectPlace& place, ObjectLook& look) {
  if (place.finish.material == Material::Bark)
    look_at_bark(place, look);
  else
    look_at_leaves(place, look);
}

}  // namespace terracast::scene
