#include <cmath>

#include "scene/ground/pattern.h"
#include "scene/objects/looks/families.h"

namespace terracast::scene {
namespace {

using world::Material;

/// Water runs down what stands upright, and takes dirt along: stripes of 0.2 m to 0.5 m, longest where
/// they begin.
float streaks_of(const ObjectPlace& place) {
  const float upright = 1.0f - absolute(place.normal.z());
  const float stripe = cell_tint(place.seed ^ 5, std::floor(place.u_m / 0.30), 1.0);
  return upright * faded(ramp(3.0f * (stripe - 0.66f)), 0.173f, told(place.footprint_m, 0.6f)) *
         ramp(0.6f + 0.5f * place.coarse);
}

void look_at_concrete(const ObjectPlace& place, Rgb& color, ObjectLook& look) {
  const auto width_m = static_cast<double>(place.footprint_m);
  shade(color, 1.0f + 0.09f * place.coarse + 0.07f * place.fine);
  lay(color, 0.30f * ramp(0.6f * place.coarse - 0.2f), 0.150f, 0.140f, 0.122f);
  shade(color, 1.0f - 0.35f * streaks_of(place));
  // Joints of the formwork.
  const double joint = share_of_joints(place.u_m, place.v_m, width_m, 0.015, 2.5, 1.25);
  lay(color, 0.45f * static_cast<float>(joint), 0.085f, 0.080f, 0.072f);
  look.openness = 0.96f;
}

void look_at_boulder(const ObjectPlace& place, Rgb& color, ObjectLook& look) {
  shade(color, clamped(1.0f + 0.15f * place.coarse + 0.20f * place.fine, 0.45f, 1.6f));
  // Lichen above, earth and moss at the foot.
  const float above = ramp(place.normal.z());
  lay(color, 0.45f * above * ramp(place.fine + 0.4f * place.coarse - 0.5f), 0.230f, 0.235f, 0.170f);
  const float foot = ramp(1.0f - place.from_place_m.z() / 0.35f);
  lay(color, 0.5f * foot * ramp(0.6f + 0.4f * place.fine), 0.075f, 0.070f, 0.040f);
  look.normal = bent(place, 0.16f * place.fine, 0.16f * place.coarse);
  look.openness = clamped(0.90f + 0.10f * place.fine, 0.6f, 1.0f);
}

void look_at_planks(const ObjectPlace& place, Rgb& color, ObjectLook& look) {
  const auto width_m = static_cast<double>(place.footprint_m);
  constexpr double kPlank_m = 0.14;
  const double plank = std::floor(place.u_m / kPlank_m);
  shade(color,
        1.0f + 0.30f * told(place.footprint_m, 0.28f) * (cell_tint(place.seed, plank, 3.0) - 0.5f));
  shade(color, 1.0f + 0.08f * place.fine + 0.05f * place.coarse);
  lay(color, 0.30f * ramp(0.4f + 0.4f * place.coarse), 0.240f, 0.230f, 0.215f);  // bleached
  const double gap = share_of_bars(place.u_m, width_m, 0.008, kPlank_m);
  lay(color, static_cast<float>(gap), 0.018f, 0.016f, 0.014f);
  look.openness = 0.95f;
}

}  // namespace

void look_at_stuff(const ObjectPlace& place, ObjectLook& look) {
  Rgb color = place.color;
  switch (place.finish.material) {
    case Material::Boulder:
      look_at_boulder(place, color, look);
      break;
    case Material::Planks:
      look_at_planks(place, color, look);
      break;
    case Material::Asphalt:
      shade(color, clamped(1.0f + 0.07f * place.coarse + 0.12f * place.fine, 0.5f, 1.5f));
      look.openness = 0.97f;
      break;
    default:
      look_at_concrete(place, color, look);
      break;
  }
  look.albedo = color;
}

}  // namespace terracast::scene
