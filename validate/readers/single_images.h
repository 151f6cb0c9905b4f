#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// Of formats of single images, which hold no poses: where georeference.csv says that the cameras were. The checks of
/// poses then hold that file against itself, and see jumps and false rotations in it.
void take_georeferenced_poses(Sequence& sequence);

}  // namespace terracast::validate
