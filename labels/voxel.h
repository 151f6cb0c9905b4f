#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace terracast::labels {

/// Along the world's axes: the cube from voxel to voxel + (1, 1, 1), times the side of voxels.
using Voxel = std::array<std::int64_t, 3>;

inline Voxel voxel_of(const Eigen::Vector3d& place_m, double voxel_m) {
  Voxel voxel;
  for (int axis = 0; axis < 3; ++axis)
    voxel[static_cast<std::size_t>(axis)] =
        static_cast<std::int64_t>(std::floor(place_m[axis] / voxel_m));
  return voxel;
}

struct VoxelHash {
  std::size_t operator()(const Voxel& voxel) const noexcept {
    std::uint64_t hash = 0;
    for (const std::int64_t k : voxel) {
      hash = (hash ^ static_cast<std::uint64_t>(k)) * 0x9e3779b97f4a7c15ULL;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

}  // namespace terracast::labels
