#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

namespace terracast::tiler {

/// Whether triangles of a closed surface cross or touch each other elsewhere than at shared corners
/// and edges; corners of one place are one.
/// cost      0.5 ms for 100 triangles
/// threads   safe
bool meets_itself(std::span<const Eigen::Vector3i> places,
                  std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace terracast::tiler
