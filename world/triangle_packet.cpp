#include "world/triangle_packet.h"

#include "world/lane_vectors.h"
#include "world/tile_id.h"

namespace terracast::world {
namespace {

constexpr int kTriangles = TriangleBlock::kTriangles;

// A ray's line passes a triangle's edge e at the distance that the volume d (s x e) has over |d| |e|; a
// volume may be wrong by as much as the line, times |d| |e|. The line's own error is 12 of the 64 u M of a
// tree's margin (box_tree.cpp), or 132 of 512 u R. The volumes' roundings: s, no longer than 3.5 M, is
// rounded for 2 u M; an edge's corners, its product with d and the product with s are rounded for 8 u
// |s|, 28 u M; the third volume, which is what is left of that of two edges, errs by both of theirs and
// 8 u of the edges' product. All that is less than two margins, of the third of the sum of two edges.
constexpr float kMargins = 4.0F;

template <int kLanes>
TERRACAST_PACKET_INLINE void find(const TriangleBlock& block, const Eigen::Vector3d& center_m,
                                  double margin_m, const RayPacket<kLanes>& rays,
                                  const float* from_m, LaneBytes<kLanes>& near) {
  using Floats = typename LaneVectors<kLanes>::Floats;
  using Integers = typename LaneVectors<kLanes>::Integers;
  float corner[3][kTriangles], first_edge[3][kTriangles], second_edge[3][kTriangles];
  for (int axis = 0; axis < 3; ++axis) {
    float places[3][kTriangles];
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < kTriangles; ++i)
        places[k][i] = static_cast<float>(
            static_cast<double>(block.steps[axis][k][i]) * kHeightStep_m - center_m[axis]);
    for (int i = 0; i < kTriangles; ++i) {
      corner[axis][i] = places[0][i];
      first_edge[axis][i] = places[1][i] - places[0][i];
      second_edge[axis][i] = places[2][i] - places[0][i];
    }
  }
  float slack_first[kTriangles], slack_second[kTriangles];
  const float slack_m = kMargins * static_cast<float>(margin_m) * rays.direction_length;
  for (int i = 0; i < kTriangles; ++i) {
    const auto length = [&](const float(&edge)[3][kTriangles]) {
      return std::abs(edge[0][i]) + std::abs(edge[1][i]) + std::abs(edge[2][i]);
    };
    slack_first[i] = slack_m * length(first_edge);
    slack_second[i] = slack_m * length(second_edge);
  }
  Floats origin[3], direction[3], from, reach;
  for (int axis = 0; axis < 3; ++axis) {
    std::memcpy(&origin[axis], rays.origin[axis], sizeof(Floats));
    std::memcpy(&direction[axis], rays.direction[axis], sizeof(Floats));
  }
  std::memcpy(&from, from_m, sizeof(Floats));
  std::memcpy(&reach, rays.reach_m, sizeof(Floats));
  const auto& [dx, dy, dz] = direction;
  Integers is_near = {};
  for (int i = 0; i < kTriangles; ++i) {
    const float e1x = first_edge[0][i], e1y = first_edge[1][i], e1z = first_edge[2][i];
    const float e2x = second_edge[0][i], e2y = second_edge[1][i], e2z = second_edge[2][i];
    const Floats px = dy * e2z - dz * e2y;
    const Floats py = dz * e2x - dx * e2z;
    const Floats pz = dx * e2y - dy * e2x;
    const Floats all = px * e1x + py * e1y + pz * e1z;
    const Floats sx = origin[0] - corner[0][i];
    const Floats sy = origin[1] - corner[1][i];
    const Floats sz = origin[2] - corner[2][i];
    const Floats u = sx * px + sy * py + sz * pz;
    const Floats v =
        dx * (sy * e1z - sz * e1y) + dy * (sz * e1x - sx * e1z) + dz * (sx * e1y - sy * e1x);
    const Floats w = all - u - v;
    const float slack_u = slack_second[i];
    const float slack_v = slack_first[i];
    const float slack_w = slack_u + slack_v;
    // All three not negative, or none positive, by more than they err.
    const Floats u_up = u + slack_u, v_up = v + slack_v, w_up = w + slack_w;
    const Floats u_down = slack_u - u, v_down = slack_v - v, w_down = slack_w - w;
    const Floats uv_up = u_up < v_up ? u_up : v_up;
    const Floats uv_down = u_down < v_down ? u_down : v_down;
    const Floats up = uv_up < w_up ? uv_up : w_up;
    const Floats down = uv_down < w_down ? uv_down : w_down;
    const Integers has_near = (up > down ? up : down) >= 0.0F;
    is_near |= has_near & (1 << i);
  }
  const Integers is_here = from <= reach;
  is_near &= is_here & ((1 << block.count) - 1);
  bytes_of<kLanes>(is_near, near);
}

}  // namespace

TERRACAST_PACKET_CODE
void find_near(const TriangleBlock& block, const Eigen::Vector3d& center_m, double margin_m,
               const RayPacket<8>& rays, const float* from_m, LaneBytes<8>& near) {
  find(block, center_m, margin_m, rays, from_m, near);
}

TERRACAST_PACKET_CODE
void find_near(const TriangleBlock& block, const Eigen::Vector3d& center_m, double margin_m,
               const RayPacket<16>& rays, const float* from_m, LaneBytes<16>& near) {
  find(block, center_m, margin_m, rays, from_m, near);
}

}  // namespace terracast::world
