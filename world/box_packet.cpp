#include "world/box_packet.h"

#include <cstring>
#include <limits>

#include "world/lane_vectors.h"

namespace terracast::world {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// kHasSides   along each axis all lanes go up or all go down: which side of a box is met first is
///             known
template <int kLanes, bool kHasSides>
TERRACAST_PACKET_INLINE void meet(const BoxNode& node, const RayPacket<kLanes>& rays,
                                  const float* from_m, BoxMeetings<kLanes>& meetings) {
  using Floats = typename LaneVectors<kLanes>::Floats;
  using Integers = typename LaneVectors<kLanes>::Integers;
  const float* first[3];
  const float* last[3];
  Floats origin[3], inverse[3], from, reach;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_up = (rays.all_up >> axis & 1U) != 0 || !kHasSides;
    first[axis] = is_up ? node.low[axis] : node.high[axis];
    last[axis] = is_up ? node.high[axis] : node.low[axis];
    std::memcpy(&origin[axis], rays.origin[axis], sizeof(Floats));
    std::memcpy(&inverse[axis], rays.inverse[axis], sizeof(Floats));
  }
  std::memcpy(&from, from_m, sizeof(Floats));
  std::memcpy(&reach, rays.reach_m, sizeof(Floats));
  Integers met = {};
  for (int box = 0; box < BoxNode::kBoxes; ++box) {
    Floats enters = from;
    Floats leaves = reach;
#pragma GCC unroll 3
    for (int axis = 0; axis < 3; ++axis) {
      const Floats a = (first[axis][box] - origin[axis]) * inverse[axis];
      const Floats b = (last[axis][box] - origin[axis]) * inverse[axis];
      const Floats in = kHasSides ? a : (a < b ? a : b);
      const Floats out = kHasSides ? b : (a > b ? a : b);
      enters = enters > in ? enters : in;
      leaves = leaves < out ? leaves : out;
    }
    const Integers is_met = enters <= leaves;
    const Floats near = is_met ? enters : Floats{} + kInfinity;
    std::memcpy(meetings.near_m[box], &near, sizeof(Floats));
    met |= is_met & (1 << box);
  }
  bytes_of<kLanes>(met, meetings.met);
  for (int box = 0; box < BoxNode::kBoxes; ++box)
    meetings.order[box] = (node.low[0][box] + node.high[0][box]) * rays.direction[0][0] +
                          (node.low[1][box] + node.high[1][box]) * rays.direction[1][0] +
                          (node.low[2][box] + node.high[2][box]) * rays.direction[2][0];
}

template <int kLanes>
TERRACAST_PACKET_INLINE void prepare(RayPacket<kLanes>& rays) {
  using Floats = typename LaneVectors<kLanes>::Floats;
  using Integers = typename LaneVectors<kLanes>::Integers;
  Integers up = {};
  Integers down = {};
  for (int axis = 0; axis < 3; ++axis) {
    Floats inverse;
    std::memcpy(&inverse, rays.inverse[axis], sizeof(Floats));
    up |= (inverse > 0.0F) & (1 << axis);
    down |= (inverse < 0.0F) & (1 << axis);
  }
  LaneBytes<kLanes> goes_up, goes_down;
  bytes_of<kLanes>(up, goes_up);
  bytes_of<kLanes>(down, goes_down);
  rays.all_up = ~goes_down.any() & 7U;
  rays.all_down = ~goes_up.any() & 7U;
}

}  // namespace

TERRACAST_PACKET_CODE
void make_ready(RayPacket<8>& rays) { prepare(rays); }
TERRACAST_PACKET_CODE
void make_ready(RayPacket<16>& rays) { prepare(rays); }

TERRACAST_PACKET_CODE
void meet_boxes(const BoxNode& node, const RayPacket<8>& rays, const float* from_m,
                BoxMeetings<8>& meetings) {
  if ((rays.all_up | rays.all_down) == 7U)
    meet<8, true>(node, rays, from_m, meetings);
  else
    meet<8, false>(node, rays, from_m, meetings);
}

TERRACAST_PACKET_CODE
void meet_boxes(const BoxNode& node, const RayPacket<16>& rays, const float* from_m,
                BoxMeetings<16>& meetings) {
  if ((rays.all_up | rays.all_down) == 7U)
    meet<16, true>(node, rays, from_m, meetings);
  else
    meet<16, false>(node, rays, from_m, meetings);
}

}  // namespace terracast::world
