#include "render/looks/families.h"

namespace terracast::render {

void look_at_texture(const ObjectPlace& place, ObjectLook& look) { look.albedo = place.color; }

}  // namespace terracast::render
