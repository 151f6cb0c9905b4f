#pragma once

#include "scene/objects/object_look.h"

namespace terracast::scene {

/// Puts windows, doors and bands over a wall's look, as its finish's pattern says; glass facades have them
/// without one too.
void lay_facade(const ObjectPlace& place, ObjectLook& look);

}  // namespace terracast::scene
