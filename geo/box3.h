#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace terracast::geo {

/// An axis-aligned box in the frame that its name says.
using Box3d = Eigen::AlignedBox3d;

}  // namespace terracast::geo
