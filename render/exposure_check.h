#pragma once

#include "render/render_stage.h"

namespace terracast::render {

/// Whether a sequence's rate of frames leaves its cameras the time that they take.
/// throws Config: an image that takes longer than the time to the next, or an exposure control that looks further
/// back than is looked
void check_exposures(const SequencePlan& plan);

}  // namespace terracast::render
