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
/// one tile, else rays gathered from all groups. The groups take turns, so that they come into a
/// tile one after the other and those that have come apart meet there.
template <int kWidth>
class PacketRays {
 public:
  static constexpr std::size_t kGroups = kWidth / RayLanes::kLanes;

  explicit PacketRays(RayBatch& batch) : batch_(batch) {}

  /// False when no ray travels any more.
  bool take() {
    std::size_t turns = 0;
    while (turns < RayBatch::kGroups && batch_.travelling[group_at(turns)] == 0) ++turns;
    if (turns == RayBatch::kGroups) return false;
    next_ = group_at(turns);
    tile_ = batch_.groups[next_].tile[__builtin_ctz(batch_.travelling[next_])];
    const LaneMask lanes = lanes_in_tile(next_);
    is_gathered_ = count_lanes(lanes) < kEnough && gather();
    next_ = group_at(is_gathered_ ? 1 : take_groups(lanes) + 1);
    return true;
  }

  std::uint32_t tile() const { return tile_; }
  std::span<CastGroup, kGroups> groups() { return groups_; }

  /// Puts the rays that are still asked for, in their next tiles, back into the batch.
  void give_back() {
    for (std::size_t g = 0; g < kGroups; ++g) {
      const CastGroup& group = groups_[g];
      if (!is_gathered_) {
        batch_.travelling[static_cast<std::size_t>(group.rays - batch_.groups.data())] |=
            group.asked;
        continue;
      }
      for_each_lane(group.asked, [&](int lane) {
        const std::size_t home = home_[g * RayLanes::kLanes + static_cast<std::size_t>(lane)];
        const int home_lane = static_cast<int>(home % RayLanes::kLanes);
        batch_.groups[home / RayLanes::kLanes].copy_passage(home_lane, gathered_[g], lane);
        batch_.travelling[home / RayLanes::kLanes] |= lane_bit(home_lane);
      });
    }
  }

 private:
  /// Rays for which a group is cast as it is, although others may be in the tile: gathering copies
  /// all that is known of a ray.
  static constexpr int kEnough = 6;

  /// The group whose turn comes after so many others.
  std::size_t group_at(std::size_t turns) const { return (next_ + turns) % RayBatch::kGroups; }

  LaneMask lanes_in_tile(std::size_t g) const {
    if (batch_.travelling[g] == 0) return 0;
    const RayLanes& rays = batch_.groups[g];
    Integers is_there;
    for (int i = 0; i < RayLanes::kLanes; ++i)
      is_there[i] = static_cast<std::int32_t>(rays.tile[i] == tile_);
    return lanes_where(is_there) & batch_.travelling[g];
  }

  /// The group whose turn it is, and what other groups have enough rays in the tile.
  /// returns   how many turns after it the last of them has its own
  std::size_t take_groups(LaneMask lanes) {
    std::size_t turns = 0;
    for (std::size_t g = 0; g < kGroups; ++g) {
      const std::size_t from = group_at(turns);
      groups_[g].rays = &batch_.groups[from];
      groups_[g].asked = lanes;
      batch_.travelling[from] &= ~lanes;
      lanes = 0;
      if (g + 1 == kGroups) break;
      for (std::size_t later = turns + 1; later < RayBatch::kGroups; ++later) {
        const LaneMask others = lanes_in_tile(group_at(later));
        if (count_lanes(others) < kEnough) continue;
        turns = later;
        lanes = others;
        break;
      }
    }
    return turns;
  }

  /// As many rays in the tile as the packet takes; false when only one group has any.
  bool gather() {
    std::array<LaneMask, RayBatch::kGroups> lanes;  // by turn
    LaneMask others = 0;
    for (std::size_t turn = 0; turn < RayBatch::kGroups; ++turn) {
      lanes[turn] = lanes_in_tile(group_at(turn));
      if (turn > 0) others |= lanes[turn];
    }
    if (others == 0) return false;
    std::size_t count = 0;
    for (std::size_t turn = 0; turn < RayBatch::kGroups; ++turn) {
      const std::size_t g = group_at(turn);
      for (; lanes[turn] != 0 && count < kWidth; lanes[turn] &= lanes[turn] - 1) {
        const int lane = __builtin_ctz(lanes[turn]);
        batch_.travelling[g] &= ~lane_bit(lane);
        home_[count++] =
            static_cast<std::uint8_t>(g * RayLanes::kLanes + static_cast<std::size_t>(lane));
      }
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
  std::size_t next_ = 0;  ///< the group whose turn it is
  std::uint32_t tile_ = 0;
  std::array<CastGroup, kGroups> groups_;
  bool is_gathered_ = false;
  std::array<RayLanes, kGroups> gathered_;
  std::array<std::uint8_t, kWidth> home_ = {};  ///< of the gathered rays, in the batch
};

}  // namespace terracast::world
