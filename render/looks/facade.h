#pragma once

#include "render/object_look.h"

namespace terracast::render {

/// Puts windows, doors and bands over a wall's look, as its finish's pattern says; glass facades have them
/// without one too.
void lay_facade(const ObjectPlace& place, ObjectLook& look);

}  // namespace terracast::render
