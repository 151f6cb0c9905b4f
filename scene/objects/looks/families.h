#pragma once

#include "core/random.h"
#include "scene/objects/object_look.h"

/// Looks of objects by families of materials. Each gets a look that is matt, of the finish's colour, with
/// the triangle's normal, and says what differs.
namespace terracast::scene {

void look_at_wall(const ObjectPlace& place, ObjectLook& look);
void look_at_roof(const ObjectPlace& place, ObjectLook& look);
void look_at_plant(const ObjectPlace& place, ObjectLook& look);
/// Vehicles, machines, metal, glass, lamps.
void look_at_ware(const ObjectPlace& place, ObjectLook& look);
/// Concrete, asphalt, stone, planks: what is built or lies about.
void look_at_stuff(const ObjectPlace& place, ObjectLook& look);
/// Material::Textured.
void look_at_texture(const ObjectPlace& place, ObjectLook& look);

/// A number of [0, 1) of the object, another for each question.
inline float object_tint(const ObjectPlace& place, std::uint64_t question) {
  return static_cast<float>(core::random_bits(place.seed, question, 0) >> 40) * 0x1.0p-24f;
}

/// A value of a pattern that is seen by a share, and in place of the rest its mean.
inline float faded(float value, float mean, float seen) { return mean + seen * (value - mean); }

/// Turns a normal by the slopes of relief along u and v.
inline Eigen::Vector3f bent(const ObjectPlace& place, float slope_u, float slope_v) {
  return (place.normal - slope_u * place.u - slope_v * place.v).normalized();
}

}  // namespace terracast::scene
