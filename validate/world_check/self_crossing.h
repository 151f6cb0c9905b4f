#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

namespace terracast::world_check {

/// A triangle by its corners' places.
using Corners = std::array<std::size_t, 3>;

/// Whether a closed body meets itself: triangles that have more in common than the edges and corners that they share,
/// or edges that more than two of them share. Exact (CGAL).
/// places      of the corners, in steps
/// triangles   of one body, none without an area
bool meets_itself(std::span<const Eigen::Vector3i> places, std::span<const Corners> triangles);

}  // namespace terracast::world_check
