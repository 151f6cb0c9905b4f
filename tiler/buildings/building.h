#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tiler/buildings/building_design.h"
#include "tiler/buildings/footprint.h"

namespace terracast::tiler {

/// A building that stands, or a part of one.
struct Building {
  std::uint64_t feature = 0;
  std::uint64_t key = 0;  ///< of its instance id
  bool is_part = false;
  Footprint footprint;
  BuildingDesign design;
  std::vector<bool> attached;  ///< edges at which others stand
  std::uint64_t own = 0;       ///< drawn for it
  /// Parts: the outline's corners, about the place, under which the ground is looked at; else
  /// empty.
  std::vector<Eigen::Vector2i> ground_steps;
  Eigen::Vector2d lowest_world = Eigen::Vector2d::Zero();  ///< of the footprint
  Eigen::Vector2d highest_world = Eigen::Vector2d::Zero();
};

/// Corners, about its place, under which a building's ground is looked at.
inline const std::vector<Eigen::Vector2i>& ground_corners(const Building& building) {
  return building.ground_steps.empty() ? building.footprint.rings.front() : building.ground_steps;
}

/// Whether a place lies in its footprint.
bool contains_world(const Building& building, const Eigen::Vector2d& place_world);

/// Places in its footprint: those of a grid of 9 x 9 over its box, or of a finer one where these
/// are fewer than 12.
std::vector<Eigen::Vector2d> places_within(const Building& building);

}  // namespace terracast::tiler
