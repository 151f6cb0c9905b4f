#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "tiler/roads/road_heights.h"
#include "tiler/roads/road_network.h"
#include "world/way_network.h"

namespace terracast::tiler {

/// The roads, paths and railways of networks as a world keeps them for what moves along them. Ends of different networks
/// at one place (to 1 cm) are one node.
class WayParts {
 public:
  /// heights   of the decks of bridges; null: there are no bridges
  /// gaps      of each line, where it has no bed; ways end there
  void add(const RoadNetwork& network, const RoadHeights* heights,
           const std::vector<std::vector<std::pair<double, double>>>& gaps);
  /// Once all are there.
  world::WayNetwork take() { return std::move(network_); }

 private:
  std::uint32_t node_at(const Eigen::Vector2d& place_world);
  void add_piece(const RoadNetwork& network, const RoadHeights* heights, const Line& line,
                 const Span& span, double from_m, double to_m);

  world::WayNetwork network_;
  std::map<std::pair<std::int64_t, std::int64_t>, std::uint32_t> nodes_;
};

}  // namespace terracast::tiler
