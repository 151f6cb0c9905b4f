#include "scene/objects/looks/families.h"

namespace terracast::scene {

void look_at_texture(const ObjectPlace& place, ObjectLook& look) { look.albedo = place.color; }

}  // namespace terracast::scene
