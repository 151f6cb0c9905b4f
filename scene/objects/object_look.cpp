#include "scene/objects/object_look.h"

#include <array>
#include <cmath>

#include "core/random.h"
#include "scene/objects/looks/families.h"

namespace terracast::scene {
namespace {

using world::Material;

/// sRGB's transfer function undone (IEC 61966-2-1).
const std::array<float, 256>& linear_of_srgb() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> made{};
    for (std::size_t i = 0; i < made.size(); ++i) {
      const double value = static_cast<double>(i) / 255.0;
      made[i] = static_cast<float>(value <= 0.04045 ? value / 12.92
                                                    : std::pow((value + 0.055) / 1.055, 2.4));
    }
    return made;
  }();
  return table;
}

/// No surface is black as a hole or whiter than fresh snow.
void bound(Rgb& albedo) {
  albedo = {clamped(albedo.r, 0.004f, 0.88f), clamped(albedo.g, 0.004f, 0.88f),
            clamped(albedo.b, 0.004f, 0.88f)};
}

/// Leaves send no more back and through than they get.
void share_out(ObjectLook& look) {
  const auto share = [](float& back, float& through) {
    through = clamped(through, 0.0f, 0.92f - back);
  };
  share(look.albedo.r, look.transmitted.r);
  share(look.albedo.g, look.transmitted.g);
  share(look.albedo.b, look.transmitted.b);
}

}  // namespace

bool needs_noise(Material material) {
  switch (material) {
    case Material::Leaves:
    case Material::Needles:
    case Material::Blades:
    case Material::Paint:
    case Material::Glass:
    case Material::Rubber:
    case Material::Plain:
    case Material::Textured:
    case Material::Lamp:
      return false;
    default:
      return true;
  }
}

ObjectPlace object_place(const world::SurfaceHit& hit, const world::SurfaceSample& surface,
                         const Eigen::Vector3f& up, float footprint_m, std::uint32_t world_seed) {
  const std::array<float, 256>& linear = linear_of_srgb();
  const std::array<std::uint8_t, 3>& srgb = surface.finish.color_srgb;
  ObjectPlace place{};
  place.finish = surface.finish;
  place.color = {linear[srgb[0]], linear[srgb[1]], linear[srgb[2]]};
  place.seed = core::random_bits(world_seed, 0x6c6f6f6b, surface.provenance.instance_id);
  place.part = hit.triangle;
  place.variety = surface.variety;
  place.normal = hit.normal_world().cast<float>();
  place.from_place_m = surface.from_place_m;
  place.reach_m = surface.reach_m;
  place.height_m = surface.height_m;
  place.footprint_m = footprint_m;

  // Level along the surface; on level places east, whose patterns then need no direction.
  const Eigen::Vector3f level = up.cross(place.normal);
  const float length = level.norm();
  place.u = length > 0.05f
                ? Eigen::Vector3f(level / length)
                : Eigen::Vector3f(Eigen::Vector3f::UnitX() - place.normal.x() * place.normal)
                      .normalized();
  place.v = place.normal.cross(place.u);
  place.has_uv = surface.uv != Eigen::Vector2f::Zero();
  place.u_m = static_cast<double>(place.has_uv ? surface.uv.x() : place.u.dot(place.from_place_m));
  place.v_m = static_cast<double>(place.has_uv ? surface.uv.y() : place.v.dot(place.from_place_m));
  return place;
}

ObjectLook look_at_object(const ObjectPlace& place) {
  ObjectLook look;
  look.albedo = place.color;
  look.normal = place.normal;
  look.gloss.normal = place.normal;
  switch (place.finish.material) {
    case Material::Plaster:
    case Material::Brick:
    case Material::StoneWall:
    case Material::ConcreteWall:
    case Material::WoodWall:
    case Material::GlassFacade:
    case Material::SheetMetal:
      look_at_wall(place, look);
      break;
    case Material::RoofTiles:
    case Material::Slate:
    case Material::FlatRoof:
    case Material::MetalRoof:
    case Material::Thatch:
      look_at_roof(place, look);
      break;
    case Material::Bark:
    case Material::Leaves:
    case Material::Needles:
    case Material::Blades:
      look_at_plant(place, look);
      break;
    case Material::Paint:
    case Material::Glass:
    case Material::Rubber:
    case Material::Metal:
    case Material::Lamp:
      look_at_ware(place, look);
      break;
    case Material::Concrete:
    case Material::Asphalt:
    case Material::Boulder:
    case Material::Planks:
      look_at_stuff(place, look);
      break;
    case Material::Plain:
      break;
    case Material::Textured:
      look_at_texture(place, look);
      break;
  }
  bound(look.albedo);
  share_out(look);
  return look;
}

}  // namespace terracast::scene
