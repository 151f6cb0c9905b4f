#pragma once

#include <Eigen/Core>

namespace terracast::tiler {

/// What a LayerSite may know of the ground below its waters, for layers that put things there. Threads: safe.
class BedSite {
 public:
  virtual ~BedSite() = default;
  /// How deep the water is, from its surface to its bed, along up, m; 0 on land.
  virtual double water_depth_m(const Eigen::Vector2d& place_world) const = 0;
  /// Whether no other layer holds any of a disc (Layer::holds), water or not.
  virtual bool is_unheld(const Eigen::Vector2d& place_world, double radius_m) const = 0;
};

}  // namespace terracast::tiler
