#include "world/vdb/sparse_grid.h"

#include "world/vdb/vdb_stream.h"

namespace terracast::world {
namespace {

/// Whether all of a block is known and has one value.
bool is_uniform(const SparseBlock& block) {
  if (!block.is_known.all()) return false;
  for (const float value : block.values)
    if (value != block.values[0]) return false;
  return true;
}

void put(const SparseBlock& block, const openvdb::Coord& lowest, openvdb::FloatTree& tree) {
  static_assert(SparseBlock::kSide == openvdb::FloatTree::LeafNodeType::DIM);
  if (block.is_known.none()) return;
  if (is_uniform(block)) {
    constexpr openvdb::Index kTileOfALeaf = 1;
    tree.addTile(kTileOfALeaf, lowest, block.values[0], true);
    return;
  }
  auto* leaf = tree.touchLeaf(lowest);
  for (openvdb::Index i = 0; i < SparseBlock::kVoxels; ++i)
    if (block.is_known[i]) leaf->setValueOn(i, block.values[i]);
}

openvdb::FloatGrid::Ptr grid_of(const SparseGrid& sparse) {
  auto grid = openvdb::FloatGrid::create(sparse.unknown);
  grid->setName(sparse.name);
  for (const auto& [name, text] : sparse.notes)
    grid->insertMeta(name, openvdb::StringMetadata(text));
  // Values stand at the voxels' centres.
  openvdb::Mat4d world_from_index = openvdb::Mat4d::identity();  // of rows
  for (int axis = 0; axis < 3; ++axis) {
    world_from_index(axis, axis) = sparse.voxel_m;
    world_from_index(3, axis) = 0.5 * sparse.voxel_m;
  }
  grid->setTransform(openvdb::math::Transform::createLinearTransform(world_from_index));
  for (std::size_t i = 0; i < sparse.blocks.size(); ++i) {
    SparseBlock block;
    sparse.fill(i, block);
    const Eigen::Vector3i lowest = SparseBlock::kSide * sparse.blocks[i];
    put(block, {lowest.x(), lowest.y(), lowest.z()}, grid->tree());
  }
  grid->pruneGrid();
  return grid;
}

}  // namespace

std::vector<std::byte> encode_sparse_vdb(std::span<const SparseGrid> grids) {
  initialise_vdb();
  openvdb::GridCPtrVec all;
  for (const SparseGrid& grid : grids) all.push_back(grid_of(grid));
  return bytes_of_grids(all);
}

}  // namespace terracast::world
