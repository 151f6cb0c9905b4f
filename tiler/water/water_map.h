#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "tiler/grid.h"
#include "world/tile.h"

namespace terracast::tiler {

/// A lake, or the area of a river, on the ground. A place is in it when an odd number of its rings goes
/// round it.
struct WaterArea {
  std::uint64_t number = 0;
  std::vector<std::vector<Eigen::Vector2d>> rings_world;
  bool is_river = false;  ///< has the levels of the rivers' lines nearest to each place
  /// Of a lake: ellipsoidal at `middle_world`, and how a geoid leans there.
  double level_m = 0.0;
  Eigen::Vector2d middle_world = Eigen::Vector2d::Zero();
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double deepest_m = 2.0;

  double level_at(const Eigen::Vector2d& place) const {
    return level_m + slope.dot(place - middle_world);
  }
};

/// A straight piece of a river.
struct RiverPiece {
  Eigen::Vector2d from_world;
  Eigen::Vector2d to_world;
  double from_level_m = 0.0;  ///< ellipsoidal
  double to_level_m = 0.0;
  double half_width_m = 1.0;
  bool is_carved = true;  ///< false: it only tells the level of areas round it
};

/// Waters on the ground, found by place. Threads: safe.
class WaterMap {
 public:
  /// A lake's or river's shore is shaped so far from it at most.
  static constexpr double kReach_m = 64.0;

  /// half_size_m   of the world's square
  WaterMap(std::vector<WaterArea> areas, std::vector<RiverPiece> rivers, double half_size_m);

  const std::vector<WaterArea>& areas() const { return areas_; }
  bool is_empty() const { return areas_.empty() && rivers_.empty(); }

  /// A water near a place.
  struct Near {
    world::Cover cover = world::Cover::Lake;
    double distance_m = 0.0;  ///< to its shore, below 0 inside it, down to -kReach_m
    double level_m = 0.0;     ///< ellipsoidal, of its surface there, or where it is nearest
    double deepest_m = 0.0;
    double half_width_m = 0.0;  ///< of a river
  };
  /// All within kReach_m of a place, lakes first.
  void find(const Eigen::Vector2d& place_world, std::vector<Near>& found) const;

  /// Whether any water lies within a distance.
  bool touches(const Eigen::Vector2d& place_world, double radius_m) const;

 private:
  struct AreaIndex {
    Eigen::Vector2d low;
    Eigen::Vector2d high;
    double band_m = 1.0;
    std::vector<std::vector<std::uint32_t>> bands;  ///< edges that touch each band of y
  };
  struct Edge {
    Eigen::Vector2d a;
    Eigen::Vector2d b;
    std::uint32_t area;
  };
  struct Cell {
    std::vector<std::uint32_t> areas;
    std::vector<std::uint32_t> edges;
    std::vector<std::uint32_t> rivers;
  };

  bool is_inside(std::uint32_t area, const Eigen::Vector2d& place) const;
  const Cell* cell_at(const Eigen::Vector2d& place) const;
  template <class Add>
  void each_cell(const Eigen::Vector2d& low, const Eigen::Vector2d& high, const Add& add);
  void add_area(std::uint32_t area);
  double river_level(const Eigen::Vector2d& place, double fallback_m) const;

  std::vector<WaterArea> areas_;
  std::vector<AreaIndex> indices_;
  std::vector<Edge> edges_;
  std::vector<RiverPiece> rivers_;
  double half_size_m_;
  std::unordered_map<std::uint64_t, Cell> cells_;
};

/// Distance of a place from a straight piece, and where along it, 0 … 1, that is.
struct OnPiece {
  double distance_m;
  double along;
};
OnPiece nearest_on(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                   const Eigen::Vector2d& place);

}  // namespace terracast::tiler
