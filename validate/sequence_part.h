#pragma once

#include <vector>

#include "validate/dataset.h"

namespace terracast::validate {

/// Some frames and cameras of a sequence, as one of its own: frames numbered from 0, times from the first of them,
/// whatever stands once a frame cut to them. The stereo pair is kept where both its cameras are; COLMAP's models,
/// which are of the whole sequence, are left out. A member of Sequence or Camera that this does not speak of does not
/// compile.
/// cameras  indices, ascending
Sequence part_of(const Sequence& sequence, int first_frame, int num_frames,
                 const std::vector<int>& cameras);

}  // namespace terracast::validate
