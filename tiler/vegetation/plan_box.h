#pragma once

#include <Eigen/Core>

#include "world/tile_id.h"

namespace terracast::tiler {

/// A rectangle of the world's plane, m.
struct PlanBox {
  Eigen::Vector2d lowest;
  Eigen::Vector2d highest;

  PlanBox grown(double by_m) const { return {lowest.array() - by_m, highest.array() + by_m}; }
  bool encloses(const PlanBox& other) const {
    return (lowest.array() <= other.lowest.array()).all() &&
           (highest.array() >= other.highest.array()).all();
  }
};

/// A place on the border belongs to what lies east or north of it.
inline bool contains(const PlanBox& box, const Eigen::Vector2d& place_world) {
  return (place_world.array() >= box.lowest.array()).all() &&
         (place_world.array() < box.highest.array()).all();
}

inline PlanBox box_of(const world::TileId& id) {
  const Eigen::Vector2d corner = id.corner_world();
  return {corner, corner + Eigen::Vector2d::Constant(id.side_m())};
}

/// Whether a place lies in the world's square.
inline bool is_inside(const Eigen::Vector2d& place_world, double half_size_m) {
  return place_world.cwiseAbs().maxCoeff() < half_size_m;
}

}  // namespace terracast::tiler
