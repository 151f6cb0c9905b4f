#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "tiler/roofs/straight_skeleton.h"

namespace terracast::tiler {

enum class RoofShape : std::uint8_t {
  Flat = 0,
  Gabled,
  Hipped,
  HalfHipped,
  Pyramidal,
  Skillion,
  Gambrel,
  Mansard,
  Round,
  Dome,
  Spire,
};

struct RoofOptions {
  RoofShape shape = RoofShape::Flat;
  double height_steps = 0.0;  ///< of its highest point above the eaves; 0: as steep as slope says
  double slope = 0.6;         ///< rise over run
  double most_steps = 1e9;    ///< never higher
  Eigen::Vector2d fall = {1.0, 0.0};  ///< skillion: where it falls to
  bool ridge_across = false;          ///< gabled rectangles: along their shorter side
  /// Gabled: edges that bear gables, ring by ring; empty: gable_edges() of the polygon.
  std::vector<bool> gables = {};
};

/// A roof over a polygon: a height above the eaves at each point, and edges between points; plane
/// in each face, but for rounding.
struct Roof {
  std::vector<Eigen::Vector2i> points_steps;  ///< first the polygon's corners, ring by ring
  std::vector<double> rises_steps;            ///< above the eaves
  std::vector<std::array<int, 2>> edges;      ///< without those of the border
  /// Of each edge of the polygon the points of the roof's border between its corners, in their
  /// order: the top of its gable.
  std::vector<std::vector<int>> gable_points;
  std::vector<std::vector<int>> faces;  ///< anticlockwise

  double highest_steps() const;
};

/// returns   nothing where the shape does not fit the polygon; Flat always fits
std::optional<Roof> make_roof(const RingsSteps& rings, const RoofOptions& options);

/// Which edges bear gables on a gabled roof: the ends of its wings.
/// attached   edges at which other buildings stand, which bear gables rather than others; or none
std::vector<bool> gable_edges(const RingsSteps& rings, const std::vector<bool>& attached,
                              bool ridge_across);

}  // namespace terracast::tiler
