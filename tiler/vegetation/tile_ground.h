#pragma once

#include <Eigen/Core>
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
  Here here(const Eigen::Vector2d& place_world);
  TreeKinds tree_kinds(const Here& here) const;

 private:
  /// Of the ground at a node, taken when asked for.
  struct Facts {
    double z_world = std::numeric_limits<double>::quiet_NaN();
    double height_m = 0.0;
    double moisture = 0.0;
  };
  const Facts& facts(int i, int j);

  const VegetationPlan& plan_;
  const LayerSite& site_;
  int first_node_x_;
  int first_node_y_;
  Grid<Facts> facts_;
};

}  // namespace terracast::tiler
