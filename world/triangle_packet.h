#pragma once

#include <Eigen/Core>

#include "world/box_packet.h"
#include "world/triangle_crossing.h"

namespace terracast::world {

/// Tells which lanes of a packet come near the triangles of a block, in float. It is one-sided: a ray
/// that cross_block() says crosses a triangle comes near it.
/// center_m   of the tree of boxes about which the rays are given
/// margin_m   of that tree
/// from_m     +inf for lanes that do not come here
/// near       set to a bit for each triangle
void find_near(const TriangleBlock& block, const Eigen::Vector3d& center_m, double margin_m,
               const RayPacket<8>& rays, const float* from_m, LaneBytes<8>& near);
void find_near(const TriangleBlock& block, const Eigen::Vector3d& center_m, double margin_m,
               const RayPacket<16>& rays, const float* from_m, LaneBytes<16>& near);

}  // namespace terracast::world
