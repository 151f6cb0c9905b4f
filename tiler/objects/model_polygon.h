#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terracast::tiler {

/// Triangles of a model's face of three or more corners, which turn as it does: a fan where it is convex; else ears, cut
/// off one by one in the plane that its corners lie nearest to. Of a face that crosses itself, or has no plane, what is left
/// when there is no ear any more is a fan. Always two triangles less than corners.
/// corners   at most kMostFaceCorners
/// returns   triangles of the corners' numbers, 0 … corners - 1
/// cost      grows with the corners of a convex face, with their square of others
std::vector<std::array<std::uint32_t, 3>> triangles_of_face(
    std::span<const Eigen::Vector3d> corners);

}  // namespace terracast::tiler
