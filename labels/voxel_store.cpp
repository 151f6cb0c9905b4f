#include "labels/voxel_store.h"

#include <algorithm>
#include <limits>

#include "core/error.h"

namespace terracast::labels {

using core::ErrorKind;
using core::fail;

VoxelStore::Shard& VoxelStore::shard_of(std::size_t hash) {
  constexpr int kHighBits = 32;  // the low ones choose among a reader's entries
  return shards_[(hash >> kHighBits) % kShards];
}

void VoxelStore::take(std::int64_t num_bytes) {
  const std::int64_t taken = num_bytes_.fetch_add(num_bytes) + num_bytes;
  if (static_cast<double>(taken) > most_bytes_)
    fail(ErrorKind::Config,
         "the voxels that its images show take more than memory_bytes = {:g}: make voxel_m larger, "
         "reach_m smaller, or allow more",
         most_bytes_);
}

VoxelBlock& VoxelStore::Reader::block_of(const Voxel& voxel) {
  const Voxel place = block_place(voxel);
  const std::size_t hash = VoxelHash()(place);
  Entry& entry = entries_[hash % kEntries];
  if (entry.block != nullptr && entry.place == place) return *entry.block;
  Shard& shard = store_.shard_of(hash);
  const std::lock_guard lock(shard.mutex);
  std::unique_ptr<VoxelBlock>& block = shard.blocks[place];
  if (block == nullptr) {
    store_.take(kBytesOfBlock);
    block = std::make_unique<VoxelBlock>();
  }
  entry = {place, block.get()};
  return *block;
}

VoxelBlock::Distances& VoxelStore::Reader::distances_of(VoxelBlock& block, const Voxel& voxel) {
  if (VoxelBlock::Distances* known = block.distances()) return *known;
  Shard& shard = store_.shard_of(VoxelHash()(block_place(voxel)));
  const std::lock_guard lock(shard.mutex);
  if (block.owned_ == nullptr) {
    store_.take(kBytesOfDistances);
    block.owned_ = std::make_unique<VoxelBlock::Distances>();
    block.distances_.store(block.owned_.get(), std::memory_order_release);
  }
  return *block.owned_;
}

std::vector<VoxelStore::Placed> VoxelStore::sorted() const {
  std::vector<Placed> all;
  for (const Shard& shard : shards_)
    for (const auto& [place, block] : shard.blocks)
      if (block != nullptr)
        all.push_back(
            {{static_cast<int>(place[0]), static_cast<int>(place[1]), static_cast<int>(place[2])},
             block.get()});
  std::sort(all.begin(), all.end(), [](const Placed& a, const Placed& b) {
    return std::lexicographical_compare(a.place.begin(), a.place.end(), b.place.begin(),
                                        b.place.end());
  });
  return all;
}

}  // namespace terracast::labels
