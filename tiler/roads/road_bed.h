#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "tiler/roads/road_heights.h"
#include "tiler/roads/road_network.h"

namespace terracast::tiler {

/// A level or evenly sloping area, such as a parking place.
struct Pad {
  std::uint64_t feature = 0;
  std::vector<PointsWorld> rings_world;
  Eigen::Vector2d middle_world;
  double level_m = 0.0;  ///< at its middle
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double bank_slope = 2.0 / 3.0;
  double reach_m = 10.0;

  double level_at(const Eigen::Vector2d& place_world) const {
    return level_m + slope.dot(place_world - middle_world);
  }
};

/// The earth works of a network: within carriageways and shoulders the ground is the profile, level across;
/// beyond, banks rise and fall at 1 : 1.5 until they meet the ground; where they have not met it at
/// 0.7 of their reach, they steepen, up to a wall at the reach. Where carriageways lie over each other the
/// one deeper inside which a place lies counts more, so that there is no step. Below bridges the ground
/// stays below the deck.
///
/// cost      0.1 us where no way is near, 0.5 us to 1 us beside ways
/// threads   safe
class RoadBed {
 public:
  /// gaps   of each line, where it has no bed (water_gaps)
  RoadBed(const RoadNetwork& network, const RoadHeights& heights, const RoadGroundFunction& ground,
          const std::vector<std::vector<std::pair<double, double>>>& gaps, std::vector<Pad> pads);

  /// Whether anything changes the ground near a place.
  bool is_near(const Eigen::Vector2d& place_world) const { return cell_at(place_world) != nullptr; }
  /// … or may change it within some metres of the place: to 16 m more.
  bool is_near(const Eigen::Vector2d& place_world, double within_m) const;
  struct Shaped {
    double level_m = 0.0;
    bool is_way = false;  ///< on a carriageway, its shoulder or a pad
  };
  /// The finished ground, of the ground before.
  Shaped shaped(const Eigen::Vector2d& place_world, double ground_m) const;
  /// Whether a disc touches a carriageway, its shoulder, a wall of 8 m or more beside it, a pad or a bridge's
  /// deck.
  bool holds(const Eigen::Vector2d& place_world, double radius_m) const;
  /// Whether a disc touches a carriageway on the ground.
  bool is_on_way(const Eigen::Vector2d& place_world, double radius_m) const;

 private:
  /// Between two points of a line.
  struct Piece {
    Eigen::Vector2d a;
    Eigen::Vector2d direction;  ///< of length 1
    Eigen::Vector2d tangent_a;
    Eigen::Vector2d tangent_b;
    double length_m;
    double level_a;
    double level_b;
    float core_m;  ///< half the level width
    float
        held_m;  ///< from the line, that nothing else may stand on: the core and high walls beside it
    float bank_slope_a;
    float bank_slope_b;
    float reach_a_m;  ///< of the bank beyond the core
    float reach_b_m;
    bool is_deck;    ///< of a bridge: the ground stays below
    bool has_end_a;  ///< nothing goes on before a, on the ground
    bool has_end_b;
    bool is_open_a;  ///< the line ends here or goes on as a bridge or a tunnel: no round end
    bool is_open_b;
  };
  struct Cell {
    std::vector<std::uint32_t> pieces;
    std::vector<std::uint32_t> pads;
  };
  struct Met {
    double along_share;  ///< of the piece
    double beside_m;     ///< from its line
    double before_m;     ///< how far before or beyond its cross-sections, or 0
    bool is_beyond_b;
  };

  const Cell* cell_at(const Eigen::Vector2d& place_world) const;
  static Met meet(const Piece& piece, const Eigen::Vector2d& place_world);
  void add_pieces(const RoadNetwork& network, const RoadHeights& heights,
                  const RoadGroundFunction& ground,
                  const std::vector<std::vector<std::pair<double, double>>>& gaps);
  void index();

  std::vector<Piece> pieces_;
  std::vector<Pad> pads_;
  std::unordered_map<std::uint64_t, Cell> cells_;
};

/// Whether an odd number of rings goes round a place, and how far their nearest side is.
struct RingSide {
  bool is_inside = false;
  double distance_m = 0.0;
};
RingSide side_of_rings(const std::vector<PointsWorld>& rings_world,
                       const Eigen::Vector2d& place_world);

}  // namespace terracast::tiler
