#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/packet_code.h"
#include "world/terrain_walk.h"
#include "world/world_ray.h"

namespace terracast::world {

/// Lanes of a group of rays, a bit each.
using LaneMask = std::uint32_t;
inline constexpr LaneMask lane_bit(int lane) { return LaneMask{1} << lane; }

/// How many of eight lanes.
inline constexpr int count_lanes(LaneMask lanes) {
  // Baseline x86-64 has no instruction for it: the bits of eight, spread to digits of four bits,
  // whose sum the product has in its first digit.
  return static_cast<int>((((lanes * 0x08040201U) >> 3 & 0x11111111U) * 0x11111111U) >> 28);
}

/// Eight rays on their way through the tiles, field by field, so that what every ray goes through
/// is done for all of them together. Unused lanes hold copies of other rays.
struct RayLanes {
  static constexpr int kLanes = 8;
  template <class T>
  using Field = T[kLanes];

  // The ray: as asked, and what its direction is divided by and multiplied with.
  alignas(64) Field<double> origin_x, origin_y, origin_z;
  Field<double> direction_x, direction_y, direction_z;  ///< one too small to be divided by is 0
  Field<double> inverse_x, inverse_y, inverse_z;        ///< 0 where the component is 0
  /// What added to the t of a line across an axis makes it infinite where the ray never crosses
  /// one: 0, or +inf where the component is 0.
  Field<double> never_x, never_y, never_z;
  Field<double> length_m, inverse_length;  ///< of the direction
  Field<double> t_min, t_max;
  Field<float> unit_x, unit_y, unit_z;  ///< the direction for Embree
  Field<std::uint32_t> id;              ///< of the ray among those asked

  // Its passage through the tile where it is now.
  Field<std::uint32_t> tile;  ///< index into the cut
  /// Through which side it came in: 0 west, 1 east, 2 south, 3 north; -1: it starts inside.
  Field<std::int32_t> side;
  Field<double> t_entry, t_exit;
  /// Where it passes the height of the tile's highest point: a falling ray can meet the ground only
  /// later, a rising one only earlier; +inf for a level ray.
  Field<double> t_top;
  /// Rays that may lie on the surface where they came into the tile: they start there, or have kept
  /// to the surface since their start.
  LaneMask may_be_on_surface = 0;

  /// Sets the kLanes rays and what follows from their directions; makes negligible components 0.
  /// first_id   of rays[0]
  /// returns    those that can be traced: a finite start, a direction whose length is a number
  LaneMask load(std::span<const WorldRay, kLanes> rays, std::uint32_t first_id);
  LaneMask load(const RayFan& rays, std::uint32_t first_id);

  WalkRay walk_ray(int lane) const {
    return {.origin_world = {origin_x[lane], origin_y[lane], origin_z[lane]},
            .direction_world = {direction_x[lane], direction_y[lane], direction_z[lane]},
            .inverse_x = inverse_x[lane],
            .inverse_y = inverse_y[lane]};
  }
  /// The ray as asked, but for negligible components of its direction.
  WorldRay world_ray(int lane) const {
    return {.origin_world = {origin_x[lane], origin_y[lane], origin_z[lane]},
            .direction_world = {direction_x[lane], direction_y[lane], direction_z[lane]},
            .t_min = t_min[lane],
            .t_max = t_max[lane]};
  }
  void copy_ray(int lane, const RayLanes& from, int from_lane);
  void copy_passage(int lane, const RayLanes& from, int from_lane);
};

static_assert(RayLanes::kLanes == 8);  // as count_lanes has it

/// The groups of a packet.
template <int kLanes>
using RayGroups = std::array<const RayLanes*, kLanes / RayLanes::kLanes>;

using Doubles = RayLanes::Field<double>;
using Integers = RayLanes::Field<std::int32_t>;

/// Calls visit(lane) for each lane of a mask.
template <class Visit>
void for_each_lane(LaneMask lanes, const Visit& visit) {
  for (; lanes != 0; lanes &= lanes - 1) visit(__builtin_ctz(lanes));
}

/// The lanes whose integer, 0 or 1, is 1.
TERRACAST_PACKET_INLINE LaneMask lanes_where(const Integers& truths) {
  LaneMask lanes = 0;
  for (int i = 0; i < RayLanes::kLanes; ++i) lanes |= static_cast<LaneMask>(truths[i]) << i;
  return lanes;
}

TERRACAST_PACKET_INLINE void set_integers(const Doubles& from, Integers& to) {
  for (int i = 0; i < RayLanes::kLanes; ++i) to[i] = static_cast<std::int32_t>(from[i]);
}

}  // namespace terracast::world
