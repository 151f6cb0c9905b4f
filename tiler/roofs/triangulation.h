#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tiler/roofs/straight_skeleton.h"

namespace terracast::tiler {

/// Triangles of what lies within a border, anticlockwise, as near to equilateral as can be.
/// points   no two alike
/// border   edges between points that close round the inside
/// edges    more edges that triangles must have; those without the border are of no use
/// returns  nothing where edges cross each other or pass through points
/// threads  safe
std::optional<std::vector<std::array<int, 3>>> triangulate(
    std::span<const Eigen::Vector2i> points, std::span<const std::array<int, 2>> border,
    std::span<const std::array<int, 2>> edges);

/// What lies within an odd number of an outer ring's windings and of no hole, as valid polygons,
/// largest first: of rings that cross and touch themselves and each other in any way. Where holes
/// touch the outer ring or each other, and nothing crosses, the polygons cover exactly what the
/// rings say; where edges cross there are corners, rounded.
/// rings     outer ring first; they may turn either way
/// cost      grows with the square of the number of corners
std::vector<RingsSteps> repaired(const RingsSteps& rings);

/// The polygons of all triangles between edges whose middle is inside; where edges cross there are
/// corners, rounded, so that polygons may touch by a step.
/// edges       they may cross and cover each other; an edge without a length is none
/// is_inside   where it changes there is an edge; asked once for each triangle
/// cost        grows with the number of edges and of their crossings
/// throws      Internal: edges that cannot be triangulated
std::vector<RingsSteps> polygons_where(
    std::span<const std::array<Eigen::Vector2i, 2>> edges,
    const std::function<bool(const Eigen::Vector2d& at_steps)>& is_inside);

/// Whether rings neither cross nor touch themselves or each other, and the holes lie in the outer
/// one.
bool is_valid(const RingsSteps& rings);

/// A ring without the corners at which it does not turn.
std::vector<Eigen::Vector2i> without_straight_points(const std::vector<Eigen::Vector2i>& loop);

/// Twice the area within a ring, positive where it goes anticlockwise.
double doubled_area(std::span<const Eigen::Vector2i> ring);

}  // namespace terracast::tiler
