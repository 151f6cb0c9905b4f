#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace terracast::tiler {

/// Rings of one polygon in steps of a lattice: its outer one first, anticlockwise, then its holes,
/// clockwise; each closed by its first point, which is not repeated.
using RingsSteps = std::vector<std::vector<Eigen::Vector2i>>;

/// The interior straight skeleton of a polygon (Aichholzer et al. 1995): as its edges move inward
/// with one speed their corners draw its arcs, and each edge sweeps a face.
struct StraightSkeleton {
  struct Node {
    Eigen::Vector2d place_steps;
    double distance_steps;  ///< from the edges that meet there; 0 for corners of the polygon
  };
  /// First the polygon's corners, ring by ring.
  std::vector<Node> nodes;
  /// Of each edge, in the order of its first corner: the face that it sweeps, anticlockwise; the
  /// edge's own two corners first.
  std::vector<std::vector<int>> faces;
};

/// rings     a valid polygon: rings neither touch nor cross each other or themselves
/// returns   nothing where it cannot be computed
/// cost      0.1 ms for a house; grows with the square of the number of corners
/// threads   safe
std::optional<StraightSkeleton> straight_skeleton(const RingsSteps& rings);

}  // namespace terracast::tiler
