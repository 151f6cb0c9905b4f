#pragma once

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/packet_code.h"

namespace terracast::world {

/// Eight boxes under one node of a BoxTree, in floats about the tree's centre.
struct alignas(32) BoxNode {
  static constexpr int kBoxes = 8;
  float low[3][kBoxes];
  float high[3][kBoxes];
  std::uint32_t child[kBoxes];  ///< a node, or BoxTree::kLeaf + a leaf
};

/// A byte for each lane of a packet.
template <int kLanes>
struct LaneBytes {
  static constexpr std::size_t kWords = kLanes / 8;
  std::array<std::uint64_t, kWords> words;

  /// Bits that are set in any byte.
  std::uint32_t any() const {
    std::uint64_t all = words[0];
    for (std::size_t w = 1; w < kWords; ++w) all |= words[w];
    all |= all >> 32;
    all |= all >> 16;
    return static_cast<std::uint32_t>((all | all >> 8) & 0xffU);
  }
  /// Calls visit(lane, byte) for those that are not 0.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (std::size_t w = 0; w < kWords; ++w) {
      for (std::uint64_t left = words[w]; left != 0;) {
        const int shift = __builtin_ctzll(left) & ~7;
        visit(static_cast<int>(8 * w) + shift / 8,
              static_cast<std::uint32_t>(left >> shift & 0xffU));
        left &= ~(std::uint64_t{0xff} << shift);
      }
    }
  }
};

/// Rays that go through a BoxTree together, as BoxTree::Ray, field by field. A lane that has nothing to
/// look for, or no more, has a reach below 0; its other numbers are those of some ray.
template <int kLanes>
struct RayPacket {
  alignas(64) float origin[3][kLanes];  ///< about the tree's centre
  float direction[3][kLanes];           ///< m a metre of the world
  float inverse[3][kLanes];
  float reach_m[kLanes];
  double t_origin[kLanes];
  double length_m[kLanes];
  double margin_m;
  float direction_length;  ///< as all of them have it
  // What make_ready() finds.
  /// Bits of the axes along which all lanes go up, and of those along which all go down.
  std::uint32_t all_up, all_down;

  static constexpr float kDone = -1.0F;
  void end(int lane) { reach_m[lane] = kDone; }
  /// A bit for each lane whose near_m lies within its reach.
  /// near_m   aligned to 16 bytes
  std::uint32_t reaching(const float* near_m) const {
    constexpr int kAtOnce = 4;
    std::uint32_t lanes = 0;
    for (int lane = 0; lane < kLanes; lane += kAtOnce)
      lanes |= static_cast<std::uint32_t>(_mm_movemask_ps(
                   _mm_cmple_ps(_mm_load_ps(near_m + lane), _mm_load_ps(reach_m + lane))))
               << lane;
    return lanes;
  }
  /// As BoxTree::Ray::end_at().
  void end_at(int lane, double t) {
    constexpr double kRounding = 1.0 + 0x1.0p-20;
    reach_m[lane] =
        std::min(reach_m[lane],
                 static_cast<float>((t - t_origin[lane]) * length_m[lane] * kRounding + margin_m));
  }
};

/// To be called when the rays are there.
void make_ready(RayPacket<8>& rays);
void make_ready(RayPacket<16>& rays);

/// Where the lanes of a packet come into the boxes of a node.
template <int kLanes>
struct BoxMeetings {
  alignas(64) float near_m[BoxNode::kBoxes][kLanes];  ///< +inf: not within their reach
  LaneBytes<kLanes> met;                              ///< a bit for each box
  float order[BoxNode::kBoxes];                       ///< of the boxes along the first ray
};

/// The same lanes and boxes that one ray after the other would meet, but for roundings within the
/// tree's margin.
/// from_m   where each lane begins; +inf: it does not come here
void meet_boxes(const BoxNode& node, const RayPacket<8>& rays, const float* from_m,
                BoxMeetings<8>& meetings);
void meet_boxes(const BoxNode& node, const RayPacket<16>& rays, const float* from_m,
                BoxMeetings<16>& meetings);

}  // namespace terracast::world
