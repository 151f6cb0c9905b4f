#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "world/ray_lanes.h"
#include "world/tile_cast.h"

namespace terracast::world {

/// Rays that travel together. Those in the same tile are cast as packets, so that packets are full
/// where rays diverge.
struct RayBatch {
  static constexpr std::size_t kGroups = 8;
  static constexpr std::size_t kRays = kGroups * RayLanes::kLanes;
  std::array<RayLanes, kGroups> groups;
  std::array<LaneMask, kGroups> travelling = {};  ///< rays that are in a tile, not yet cast there
};

/// Takes from a batch the rays for one packet after the other: a whole group where most of it is in
/// one tile, else rays gathered from all groups.
template <int kWidth>
class PacketRays {
 public:
  static constexpr std::size_t kGroups = kWidth / RayLanes::kLanes;

  explicit PacketRays(RayBatch& batch) : batch_(batch) {}

  /// False when no ray travels any more.
  bool take() {
    while (first_ < RayBatch::kGroups && batch_.travelling[first_] == 0) ++first_;
    if (first_ == RayBatch::kGroups) return false;
    tile_ = batch_.groups[first_].tile[__builtin_ctz(batch_.travelling[first_])];
    const LaneMask lanes = lanes_in_tile(first_);
    is_gathered_ = __builtin_popcount(lanes) < kEnough && gather();
    if (!is_gathered_) take_groups(lanes);
    return true;
  }

  std::uint32_t tile() const { return tile_; }
  std::span<CastGroup, kGroups> groups() { return groups_; }

  /// Puts the rays that are still asked for, in their next tiles, back into the batch.
  void give_back() {
    for (std::size_t g = 0; g < kGroups; ++g) {
      if (!is_gathered_) {
        batch_.travelling[home_group_[g]] |= groups_[g].asked;
        continue;
      }
      for_each_lane(groups_[g].asked, [&](int lane) {
        const std::size_t home = home_[g * RayLanes::kLanes + static_cast<std::size_t>(lane)];
        const std::size_t group = home / RayLanes::kLanes;
        const int home_lane = static_cast<int>(home % RayLanes::kLanes);
        batch_.groups[group].copy_passage(home_lane, gathered_[g], lane);
        batch_.travelling[group] |= lane_bit(home_lane);
      });
    }
  }

 private:
  /// Rays for which a group is cast as it is: gathering costs as much as the idle lanes.
  static constexpr int kEnough = 6;

  LaneMask lanes_in_tile(std::size_t g) const {
    const RayLanes& rays = batch_.groups[g];
    RayLanes::Field<std::int32_t> is_there;
    for (int i = 0; i < RayLanes::kLanes; ++i)
      is_there[i] = static_cast<std::int32_t>(rays.tile[i] == tile_);
    return lanes_where(is_there) & batch_.travelling[g];
  }

  /// `first_` and what other groups have enough rays in the tile.
  void take_groups(LaneMask lanes) {
    std::size_t from = first_;
    for (std::size_t g = 0; g < kGroups; ++g) {
      groups_[g].rays = &batch_.groups[from];
      groups_[g].asked = lanes;
      home_group_[g] = from;
      batch_.travelling[from] &= ~lanes;
      lanes = 0;
      if (g + 1 == kGroups) break;
      for (std::size_t other = from + 1; other < RayBatch::kGroups; ++other) {
        if (batch_.travelling[other] == 0) continue;
        const LaneMask others = lanes_in_tile(other);
        if (__builtin_popcount(others) < kEnough) continue;
        from = other;
        lanes = others;
        break;
      }
    }
  }

  /// As many rays in the tile as the packet takes; false when only `first_` has any.
  bool gather() {
    std::array<LaneMask, RayBatch::kGroups> lanes;
    bool has_others = false;
    for (std::size_t g = first_; g < RayBatch::kGroups; ++g) {
      lanes[g] = batch_.travelling[g] == 0 ? 0 : lanes_in_tile(g);
      has_others |= g != first_ && lanes[g] != 0;
    }
    if (!has_others) return false;
    std::size_t count = 0;
    for (std::size_t g = first_; g < RayBatch::kGroups; ++g)
      for (; lanes[g] != 0 && count < kWidth; lanes[g] &= lanes[g] - 1) {
        const int lane = __builtin_ctz(lanes[g]);
        batch_.travelling[g] &= ~lane_bit(lane);
        home_[count++] =
            static_cast<std::uint8_t>(g * RayLanes::kLanes + static_cast<std::size_t>(lane));
      }
    for (std::size_t i = 0; i < kWidth; ++i) {
      const std::size_t home = home_[std::min(i, count - 1)];
      const RayLanes& from = batch_.groups[home / RayLanes::kLanes];
      const int from_lane = static_cast<int>(home % RayLanes::kLanes);
      RayLanes& to = gathered_[i / RayLanes::kLanes];
      const int lane = static_cast<int>(i % RayLanes::kLanes);
      to.copy_ray(lane, from, from_lane);
      to.copy_passage(lane, from, from_lane);
    }
    for (std::size_t g = 0; g < kGroups; ++g) {
      const std::size_t begin = g * RayLanes::kLanes;
      const std::size_t here =
          std::min<std::size_t>(count > begin ? count - begin : 0, RayLanes::kLanes);
      groups_[g].rays = &gathered_[g];
      groups_[g].asked = lane_bit(static_cast<int>(here)) - 1;
    }
    return true;
  }

  RayBatch& batch_;
  std::size_t first_ = 0;  ///< the first group that still travels
  std::uint32_t tile_ = 0;
  std::array<CastGroup, kGroups> groups_;
  bool is_gathered_ = false;
  std::array<std::size_t, kGroups> home_group_ = {};
  std::array<RayLanes, kGroups> gathered_;
  std::array<std::uint8_t, kWidth> home_ = {};  ///< of the gathered rays, in the batch
};

}  // namespace terracast::world
