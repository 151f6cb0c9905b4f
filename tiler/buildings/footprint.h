#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "tiler/roofs/straight_skeleton.h"
#include "tiler/vector_source.h"
#include "world/tile.h"

namespace terracast::tiler {

/// Steps of the world's lattice.
constexpr double steps(double value_m) { return value_m / world::kHeightStep_m; }

/// A place above the plane of rings, in steps.
inline Eigen::Vector3d at_height(const Eigen::Vector2i& place, double height) {
  return {static_cast<double>(place.x()), static_cast<double>(place.y()), height};
}

/// What was found wrong with footprints and put right, or left out.
struct FootprintCounts {
  std::int64_t num_repaired = 0;    ///< crossed or touched themselves, or holes lay outside
  std::int64_t num_simplified = 0;  ///< had more corners than buildings have
  std::int64_t num_narrow = 0;  ///< had necks, slits or corners too narrow for walls to stand back
  std::int64_t num_too_small = 0;  ///< left out: less than 4 m2, or no area
  std::int64_t num_too_large = 0;  ///< left out: wider than 4 km
};

/// A valid polygon on the ground.
struct Footprint {
  Eigen::Vector2i place_m = Eigen::Vector2i::Zero();  ///< world x and y, near its middle
  RingsSteps rings;  ///< about its place, in steps of world::kHeightStep_m
};

/// The footprints of one polygon, largest first: two parts and more where it crosses itself or has
/// necks that are narrower than walls stand back on both sides (kMostInset_m). moved_edges() moves
/// each one's edges inward by as much.
/// rings_world   outer one first, as sources have them
/// cost          bounded: beyond 20 000 corners every n-th is taken, and of what is left at most
///               400 are kept
std::vector<Footprint> footprints_of(const std::vector<PointsWorld>& rings_world,
                                     FootprintCounts& counts);

/// The polygon whose edges have moved outward (below 0: inward), each by its own distance; nothing
/// where an edge would vanish or rings would touch.
/// by_steps   of each edge, ring by ring
std::optional<RingsSteps> moved_edges(const RingsSteps& rings, const std::vector<double>& by_steps);
std::optional<RingsSteps> moved_edges(const RingsSteps& rings, double by_steps);

std::size_t num_corners(const RingsSteps& rings);
/// m2, holes left out.
double area_m2(const RingsSteps& rings);
/// Whether a place lies within the outer ring and in no hole.
bool contains(const RingsSteps& rings, const Eigen::Vector2d& at_steps);
/// Distance to the nearest edge, in steps.
double distance_to_edges(const RingsSteps& rings, const Eigen::Vector2d& at_steps);

/// The narrowest rectangle round a ring.
struct Rectangle {
  Eigen::Vector2d middle_steps;
  Eigen::Vector2d along;  ///< unit vector of its longer side
  double length_steps;
  double width_steps;
};
Rectangle rectangle_round(const std::vector<Eigen::Vector2i>& ring);

/// The rings that a block of a building stands on: of many corners, a rectangle of their area, which may reach
/// beyond them.
RingsSteps block_of(const RingsSteps& rings);

}  // namespace terracast::tiler
