#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "tiler/roads/road_network.h"

namespace terracast::tiler {

/// Heights are those above a paraboloid that touches the Earth's curve at the world's origin: level
/// ground has one such height to within 5e-5 of slope.
inline constexpr double kEarthRadius_m = 6371000.0;
inline double level_of(const Eigen::Vector2d& place_world, double z_world) {
  return z_world + place_world.squaredNorm() / (2.0 * kEarthRadius_m);
}
inline double z_of(const Eigen::Vector2d& place_world, double level_m) {
  return level_m - place_world.squaredNorm() / (2.0 * kEarthRadius_m);
}

/// The ground before roads.
struct RoadGround {
  double level_m = 0.0;
  bool is_water = false;
};
/// threads   safe
using RoadGroundFunction = std::function<RoadGround(const Eigen::Vector2d& place_world)>;

/// A bridge's way over another way.
struct BridgeCrossing {
  Eigen::Vector2d at_world;
  std::uint32_t line_above = 0;
  std::uint32_t span_above = 0;   ///< of its line
  std::uint32_t point_above = 0;  ///< the piece of the line begins here
  double share_above = 0.0;       ///< of the piece
  double along_above_m = 0.0;
  std::uint32_t line_below = 0;
  std::uint32_t point_below = 0;
  double share_below = 0.0;
  double along_below_m = 0.0;
  double wanted_m = 0.0;  ///< from the lower way to the bridge's own
  double room_m = 0.0;    ///< that it has
  /// Less than it wants, by more than is lost in rounding off.
  bool is_low() const { return room_m < wanted_m - 0.25; }
};

/// All of a network, by line and place along it.
std::vector<BridgeCrossing> bridge_crossings(const RoadNetwork& network);

/// Long profiles of a network: a height for each station. They follow the ground, smoothed along the ways,
/// as far as the steepest grade of each class allows: of all heights within the grades' limits, the mean of
/// the highest below and the lowest above the ground. What bridges need is then raised within the limits.
class RoadHeights {
 public:
  RoadHeights(const RoadNetwork& network, const RoadGroundFunction& ground);

  /// At stations.
  const std::vector<double>& levels_m() const { return levels_m_; }
  /// Of the ground below stations.
  const std::vector<RoadGround>& grounds() const { return grounds_; }

  double level_m(const Line::Point& point) const {
    return (1.0 - point.share) * levels_m_[point.station] +
           point.share * levels_m_[point.next_station];
  }
  double ground_m(const Line::Point& point) const {
    return (1.0 - point.share) * grounds_[point.station].level_m +
           point.share * grounds_[point.next_station].level_m;
  }

  const std::vector<BridgeCrossing>& crossings() const { return crossings_; }

  /// Thickness of a bridge's deck.
  static double deck_m(const WayStyle& style) { return style.use == WayUse::Path ? 0.5 : 1.1; }

 private:
  struct Limit {
    std::uint32_t to;
    double most_m;
  };
  void follow_ground(const RoadNetwork& network, const RoadGroundFunction& ground);
  void add_limits(const RoadNetwork& network);
  void couple(const RoadNetwork& network);
  void smooth(const RoadNetwork& network, int num_rounds);
  void bound_grades();
  void raise_bridges(const RoadNetwork& network);
  /// Whether the limits let two stations lie so far above each other.
  bool may_part(std::uint32_t above, std::uint32_t below, double by_m) const;
  double level_between_m(const Line& line, std::uint32_t point, double share) const {
    return (1.0 - share) * level_m(line.points[point]) + share * level_m(line.points[point + 1]);
  }
  /// The lowest heights within the limits that are nowhere below.
  std::vector<double> spread_up(std::vector<double> least_m) const;

  std::vector<double> levels_m_;
  std::vector<RoadGround> grounds_;
  std::vector<std::uint8_t> is_free_;  ///< of the ground: on bridges and in tunnels
  std::vector<std::vector<Limit>> limits_;
  std::vector<BridgeCrossing> crossings_;
};

}  // namespace terracast::tiler
