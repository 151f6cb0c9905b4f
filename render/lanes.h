#pragma once

#include "core/lanes.h"

namespace terracast::render {

using core::kLanes;
using core::Lanes;
using core::Lanes3d;
using core::Lanes3f;

}  // namespace terracast::render
