#pragma once

#include "core/lanes.h"

namespace terracast::scene {

using core::kLanes;
using core::Lanes;
using core::Lanes3d;
using core::Lanes3f;

}  // namespace terracast::scene
