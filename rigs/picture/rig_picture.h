#pragma once

#include "rigs/picture/drawing.h"
#include "rigs/rig_view.h"

namespace terracast::rigs {

/// The rig as a picture: its frusta from behind, the right and above; how many cameras see each direction, on the whole
/// sphere in Hammer's equal-area projection, with the outline of each image; the overlaps of the fields of view; a
/// table of the cameras.
Drawing draw_rig(const RigView& rig);

}  // namespace terracast::rigs
