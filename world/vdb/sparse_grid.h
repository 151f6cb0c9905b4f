#pragma once

#include <Eigen/Core>
#include <array>
#include <bitset>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

/// Grids of floats of which most is not known, for OpenVDB files.
namespace terracast::world {

/// 8 x 8 x 8 voxels.
struct SparseBlock {
  static constexpr int kSide = 8;
  static constexpr int kVoxels = kSide * kSide * kSide;
  /// Place of a voxel, each coordinate 0 to 7, in both members.
  static constexpr std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>((x * kSide + y) * kSide + z);
  }
  std::bitset<kVoxels> is_known;
  std::array<float, kVoxels> values;  ///< those that are not known do not count
};

struct SparseGrid {
  std::string name;
  /// Voxel (i, j, k) is the cube from (i, j, k) to (i + 1, j + 1, k + 1) times this, in the world's frame; OpenVDB's
  /// index (i, j, k) lies at its centre.
  double voxel_m = 1.0;
  float unknown = 0.0F;  ///< value of what is not known, which is not active
  /// Texts that the grid carries: name, text.
  std::vector<std::pair<std::string, std::string>> notes = {};
  /// The blocks in which anything may be known, each once: their lowest voxels' places divided by kSide.
  std::span<const Eigen::Vector3i> blocks;
  /// Fills one of them, which comes with nothing known. Called once a block.
  std::function<void(std::size_t block, SparseBlock& out)> fill;
};

/// The bytes of an OpenVDB file of float grids. What is of one value is held as tiles. Same grids, same bytes, in
/// whatever order the blocks come.
/// memory   of each block of which not all is one value 2.2 kB, and the bytes twice
std::vector<std::byte> encode_sparse_vdb(std::span<const SparseGrid> grids);

}  // namespace terracast::world
