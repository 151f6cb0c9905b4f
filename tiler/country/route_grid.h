#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "tiler/country/plan_ground.h"

namespace terracast::tiler::country {

/// A metre over a lake costs so much more: ways go round, but where that is far.
inline constexpr double kOverLakes = 8.0;

/// What a way through the land costs.
struct RouteStyle {
  double steepest = 0.08;      ///< rise over run that is meant; steeper costs much
  double climb = 2.0;          ///< weight of rises below that
  double side_slope = 1.5;     ///< weight of the ground's own slope
  double water = 8.0;          ///< a metre over the sea
  double water_reach_m = 280;  ///< from land that may be bridged
  double river_m = 120.0;      ///< for crossing a river
  double reuse = 0.4;          ///< a metre along what is there
  double beside = 1.5;         ///< a metre close beside what is there
  double tunnel = 0.0;         ///< a metre through a mountain; 0: none
  /// More for the metre at a place: 1 is as it is, 0 is forbidden.
  std::function<double(const Point&)> avoid = {};
  /// What `avoid` said of nodes, of one grid: shared by copies, so that a place is asked for once.
  std::shared_ptr<std::vector<float>> avoided = std::make_shared<std::vector<float>>();
};

/// A grid of places between which ways are found, and the net of those that were.
class RouteGrid {
 public:
  /// is_river   of the ground's grid
  RouteGrid(const PlanGround& ground, const Grid<std::uint8_t>& is_river);

  struct Edge {
    int from, to;  ///< from < to
    int kind;
    bool is_tunnel;
  };

  int node_at(const Point& at) const;
  Point place(int node) const;
  double spacing_m() const { return spacing_m_; }
  /// The cheapest way of nodes (A*), or nothing.
  std::optional<std::vector<int>> route(int from, int to, const RouteStyle& style) const;
  /// Adds a way to the net: edges that are there keep their kind.
  void add(const std::vector<int>& nodes, int kind);
  const std::vector<Edge>& edges() const { return edges_; }
  bool is_in_net(int node) const { return near_[static_cast<std::size_t>(node)] == 2; }

 private:
  std::uint64_t key_of(int a, int b) const;
  double height_m(int node) const { return heights_m_[static_cast<std::size_t>(node)]; }

  const PlanGround& ground_;
  int stride_;
  int side_;
  double spacing_m_;
  std::vector<float> heights_m_;
  std::vector<float> slopes_;
  std::vector<float> land_m_;  ///< distance to land; 0: land
  std::vector<std::uint8_t> is_river_;
  std::vector<std::uint8_t> near_;  ///< 2: of the net, 1: beside it
  std::vector<Edge> edges_;
  std::unordered_map<std::uint64_t, std::size_t> edge_of_;
};

/// How far ways leave the nodes of their route to run smoothly.
struct Easing {
  int rounds = 14;            ///< in which places are drawn to the middle of their neighbours
  double reach = 0.8;         ///< spacings of the grid that a place is moved at most
  double least_yield = 0.35;  ///< of how far it is drawn, on steep slopes
};

/// A chain of the net's edges as a curve: through junctions it runs straight on where its kind does.
struct Alignment {
  int kind = 0;
  PointsWorld line;
  std::vector<std::pair<double, double>> tunnels_m;  ///< along the line
};
std::vector<Alignment> alignments(const RouteGrid& net, const PlanGround& ground,
                                  const Easing& easing = {});

}  // namespace terracast::tiler::country
