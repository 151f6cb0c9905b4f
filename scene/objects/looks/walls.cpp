#include <cmath>

#include "scene/ground/pattern.h"
#include "scene/objects/looks/facade.h"
#include "scene/objects/looks/families.h"

namespace terracast::scene {
namespace {

using world::Material;

/// Bricks or ashlars in courses, each course shifted by half a stone, with mortar between.
struct Courses {
  double stone_m;
  double course_m;
  double joint_m;
  float tone;  ///< by how much stones differ
};

void lay_courses(const ObjectPlace& place, const Courses& courses, const Rgb& mortar, Rgb& color) {
  const auto width_m = static_cast<double>(place.footprint_m);
  const double course = std::floor(place.v_m / courses.course_m);
  const double shifted_m =
      place.u_m + 0.5 * courses.stone_m * (course - 2.0 * std::floor(0.5 * course));
  const double stone = std::floor(shifted_m / courses.stone_m);
  const float seen = told(place.footprint_m, static_cast<float>(courses.stone_m));
  shade(color, 1.0f + 2.0f * courses.tone * seen * (cell_tint(place.seed, stone, course) - 0.5f));
  const double joint = share_of_joints(shifted_m, place.v_m, width_m, courses.joint_m,
                                       courses.stone_m, courses.course_m);
  lay(color, static_cast<float>(joint), mortar);
}

void look_at_boards(const ObjectPlace& place, Rgb& color) {
  const auto width_m = static_cast<double>(place.footprint_m);
  const bool is_upright = object_tint(place, 11) < 0.5f;
  const double across_m = is_upright ? place.u_m : place.v_m;
  constexpr double kBoard_m = 0.16;
  const double board = std::floor(across_m / kBoard_m);
  shade(color,
        1.0f + 0.34f * told(place.footprint_m, 0.32f) * (cell_tint(place.seed, board, 5.0) - 0.5f));
  const double gap = share_of_bars(across_m, width_m, 0.012, kBoard_m);
  lay(color, 0.85f * static_cast<float>(gap), 0.020f, 0.017f, 0.014f);
  // Grey where the sun and the rain come to it.
  lay(color, 0.35f * object_tint(place, 12) * ramp(0.5f + 0.5f * place.coarse), 0.190f, 0.180f,
      0.165f);
  shade(color, 1.0f + 0.10f * place.fine);
}

/// Sheets with a wave of 0.25 m across: seen, it bends the normal; unseen, it darkens as its hollows do.
void look_at_sheets(const ObjectPlace& place, Rgb& color, ObjectLook& look) {
  constexpr double kWave_m = 0.25;
  const auto turn = static_cast<float>(place.u_m / kWave_m - std::floor(place.u_m / kWave_m));
  const float seen = told(place.footprint_m, 0.25f);
  // A sine by its parabolas, within 6 %.
  const float half = turn < 0.5f ? turn : turn - 0.5f;
  const float sine = (turn < 0.5f ? 16.0f : -16.0f) * half * (0.5f - half);
  look.normal = bent(place, 0.55f * seen * sine, 0.0f);
  shade(color, 1.0f + 0.04f * place.coarse);
  const double sheet = std::floor(place.u_m / 1.0);
  shade(color,
        1.0f + 0.06f * told(place.footprint_m, 2.0f) * (cell_tint(place.seed, sheet, 6.0) - 0.5f));
  const float rust = object_tint(place, 13);
  lay(color, 0.6f * ramp(rust - 0.55f) * ramp(0.8f * place.coarse + 0.4f * place.fine - 0.4f),
      0.160f, 0.075f, 0.038f);
  look.gloss = {.share = 0.5f,
                .facing = {0.10f, 0.10f, 0.10f},
                .roughness = 0.30f + 0.2f * (1.0f - seen),
                .normal = look.normal};
}

/// Rain washes dust down in stripes, splashes earth against the foot, and leaves stains.
void weather(const ObjectPlace& place, Rgb& color) {
  const float age = object_tint(place, 14);
  shade(color, 1.0f + 0.04f * place.coarse + 0.025f * place.fine);
  const float stripe = cell_tint(place.seed ^ 9, std::floor(place.u_m / 0.22), 2.0);
  const float run = faded(ramp(4.0f * (stripe - 0.74f)), 0.135f, told(place.footprint_m, 0.5f)) *
                    ramp(0.4f + 0.5f * place.coarse);
  shade(color, 1.0f - 0.22f * age * run);
  lay(color, 0.20f * age * ramp(0.7f * place.coarse - 0.4f), 0.160f, 0.150f, 0.130f);
  if (!place.has_uv) return;
  const auto above_foot_m = static_cast<float>(place.v_m);
  lay(color, 0.45f * ramp(1.0f - (above_foot_m + 0.15f * place.fine) / 0.55f), 0.120f, 0.105f,
      0.082f);
}

void look_at_bare_wall(const ObjectPlace& place, Rgb& color, ObjectLook& look) {
  switch (place.finish.material) {
    case Material::Brick: {
      lay_courses(place, {.stone_m = 0.25, .course_m = 0.077, .joint_m = 0.011, .tone = 0.26f},
                  {0.300f, 0.285f, 0.255f}, color);
      break;
    }
    case Material::StoneWall: {
      const double size = 0.8 + 0.6 * static_cast<double>(object_tint(place, 10));
      lay_courses(place,
                  {.stone_m = 0.55 * size, .course_m = 0.28 * size, .joint_m = 0.02, .tone = 0.28f},
                  {0.250f, 0.235f, 0.205f}, color);
      shade(color, clamped(1.0f + 0.10f * place.fine, 0.5f, 1.5f));
      look.openness = 0.95f;
      break;
    }
    case Material::ConcreteWall: {
      const double joint = share_of_joints(place.u_m, place.v_m,
                                           static_cast<double>(place.footprint_m), 0.02, 3.0, 1.5);
      lay(color, 0.45f * static_cast<float>(joint), 0.090f, 0.085f, 0.078f);
      const float panel =
          cell_tint(place.seed, std::floor(place.u_m / 3.0), std::floor(place.v_m / 1.5));
      shade(color, 1.0f + 0.10f * told(place.footprint_m, 3.0f) * (panel - 0.5f));
      break;
    }
    case Material::WoodWall:
      look_at_boards(place, color);
      break;
    case Material::SheetMetal:
      look_at_sheets(place, color, look);
      break;
    default:
      break;
  }
}

}  // namespace

void look_at_wall(const ObjectPlace& place, ObjectLook& look) {
  Rgb color = place.color;
  // What is painted white is grey of some years.
  shade(color, 0.80f + 0.14f * object_tint(place, 15));
  // Limewash and paint bleach: strong colours more than pale ones.
  if (place.finish.material == Material::Plaster) {
    const float grey = 0.3f * color.r + 0.6f * color.g + 0.1f * color.b;
    lay(color, 0.16f + 0.12f * object_tint(place, 16), grey, grey, grey);
  }
  look_at_bare_wall(place, color, look);
  weather(place, color);
  look.albedo = color;
  lay_facade(place, look);
}

}  // namespace terracast::scene
