#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "world/shape.h"

namespace terracast::world_check {

/// A solid as it is shown.
struct ShownSolid {
  std::uint32_t instance_id = 0;
  Eigen::Vector3i origin_steps = Eigen::Vector3i::Zero();
  const world::Shape* shape = nullptr;
};

/// Two solids that have faces in one plane, over each other: which of them a ray meets there is chance.
struct Coincident {
  std::size_t first = 0, second = 0;  ///< of the solids given, first < second
  double area_m2 = 0.0;
  Eigen::Vector3d place_steps = Eigen::Vector3d::Zero();  ///< in the world, of one such place
};

/// All pairs of different objects with more than 0.01 m2 of such faces, whichever way they face, by first and second.
/// Planes that are less than 1.5 steps of height apart all over what two triangles share count as one: corners are rounded
/// to steps, and what a program has put into one plane may lie 1.4 steps apart by that. Sheets are left out (is_sheet).
/// are_shown   whether two of them may be shown in one image; without it: all
/// cost        by boxes: of solids whose boxes meet the triangles in the box of both
std::vector<Coincident> find_coincident(
    std::span<const ShownSolid> solids,
    const std::function<bool(std::size_t first, std::size_t second)>& are_shown = nullptr);

}  // namespace terracast::world_check
