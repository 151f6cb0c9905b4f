#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <unordered_set>
#include <utility>
#include <vector>

#include "job/traffic/tally.h"
#include "job/traffic/traffic.h"

namespace terracast::job {

/// Keeps of each entry's those that come within its reach of the cameras, the `most` nearest of these.
/// One   has options(), key() and distance_m(time_s, at_world)
template <class One>
void keep_near(std::vector<std::unique_ptr<One>>& all, std::span<const TrafficOptions> options,
               std::span<const geo::BodyState> frames, Tally& tally) {
  std::map<const TrafficOptions*, std::vector<std::pair<double, std::uint64_t>>> near;
  for (const auto& one : all) {
    double nearest_m = 1e300;
    for (const geo::BodyState& frame : frames) {
      const Eigen::Vector2d at = frame.world_from_body.translation.head(2);
      nearest_m = std::min(nearest_m, one->distance_m(frame.time_s, at));
    }
    if (nearest_m <= one->options().reach_m)
      near[&one->options()].emplace_back(nearest_m, one->key());
  }
  std::unordered_set<std::uint64_t> kept;
  for (const TrafficOptions& one : options) {
    auto& of_entry = near[&one];
    std::sort(of_entry.begin(), of_entry.end());
    const auto most = std::min(of_entry.size(), static_cast<std::size_t>(one.most));
    tally.num_beyond += static_cast<std::int64_t>(of_entry.size() - most);
    for (std::size_t i = 0; i < most; ++i) kept.insert(of_entry[i].second);
  }
  std::erase_if(all, [&](const auto& one) { return !kept.contains(one->key()); });
}

}  // namespace terracast::job
