#include "world/parked_rays.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace terracast::world {

void ParkedRays::park(const RayLanes& rays, LaneMask lanes) {
  if (lanes == 0) return;
  const std::uint32_t tile = rays.tile[__builtin_ctz(lanes)];
  const auto found = std::find_if(waiting_.begin(), waiting_.end(),
                                  [&](const Waiting& waiting) { return waiting.tile == tile; });
  Waiting& waiting = found != waiting_.end()
                         ? *found
                         : waiting_.emplace_back(Waiting{
                               .tile = tile, .nearest_m = std::numeric_limits<double>::infinity()});
  for_each_lane(lanes, [&](int lane) {
    const int to = static_cast<int>(waiting.count++ % RayLanes::kLanes);
    // Unused lanes hold copies of other rays.
    if (to == 0) waiting.groups.push_back(rays);
    waiting.groups.back().copy_ray(to, rays, lane);
    waiting.groups.back().copy_passage(to, rays, lane);
    waiting.nearest_m = std::min(waiting.nearest_m, rays.t_entry[lane] * rays.length_m[lane]);
  });
}

void ParkedRays::list(std::size_t first_index, std::vector<TileDemand>& demands) {
  std::sort(waiting_.begin(), waiting_.end(),
            [](const Waiting& a, const Waiting& b) { return a.nearest_m < b.nearest_m; });
  demands.clear();
  for (const Waiting& waiting : waiting_)
    demands.push_back({first_index + waiting.tile, waiting.count});
}

ParkedRays::Groups ParkedRays::take(std::uint32_t tile) {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(),
                                  [&](const Waiting& waiting) { return waiting.tile == tile; });
  if (found == waiting_.end()) return {};
  const auto in_last = static_cast<int>((found->count - 1) % RayLanes::kLanes) + 1;
  Groups groups{.rays = std::move(found->groups), .last_lanes = lane_bit(in_last) - 1};
  waiting_.erase(found);
  return groups;
}

}  // namespace terracast::world
