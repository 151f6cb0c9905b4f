#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>

#include "tiler/grid.h"
#include "tiler/vegetation/plan_box.h"
#include "tiler/vegetation/vegetation_plan.h"

namespace terracast::tiler {

/// What plants find in a tile and round it. What is computed once and asked often is kept; all of it follows
/// from place alone.
class TileGround {
 public:
  /// What a place is like, and how much grows there.
  struct Here {
    Eigen::Vector2d place_world;
    Ground ground;
    bool is_garden = false;
    std::optional<double> canopy_m{};
    Growth growth{};
  };

  /// plan, site   live as long
  TileGround(const VegetationPlan& plan, const world::TileId& id, const LayerSite& site);

  Ground ground(const Eigen::Vector2d& place_world);
  /// For single plants.
  Here here(const Eigen::Vector2d& place_world);
  /// For pieces of forest: without what single plants alone follow, such as edges and rows.
  Here broadly(const Eigen::Vector2d& place_world);
  TreeKinds tree_kinds(const Here& here) const;

 private:
  /// Of the ground at a node, taken when asked for.
  struct Facts {
    double z_world = std::numeric_limits<double>::quiet_NaN();
    double height_m = 0.0;
    double moisture = 0.0;
  };
  const Facts& facts(int i, int j);
  /// A place's cover, or that of where it has strayed.
  world::Cover strayed_cover(const Eigen::Vector2d& place_world, world::Cover own) const;
  Ground strayed_ground(const Eigen::Vector2d& place_world);
  /// Fills in what single plants follow.
  void find_details(Ground& ground, const Eigen::Vector2d& place_world);
  double edge(const Eigen::Vector2d& place_world);
  bool is_wooded(int i, int j);
  Here here_on(const Ground& ground, const Eigen::Vector2d& place_world) const;

  const VegetationPlan& plan_;
  const LayerSite& site_;
  int first_node_x_;
  int first_node_y_;
  Grid<Facts> facts_;
  int first_edge_x_;
  int first_edge_y_;
  Grid<std::int8_t> wooded_;  ///< at nodes kEdgeNode_m apart: 1 and 0, or below 0: not known yet
};

}  // namespace terracast::tiler
