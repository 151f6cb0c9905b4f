#pragma once

#include <Eigen/Core>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "labels/voxel.h"

/// What rays tell of voxels, summed up by many threads. All sums are of whole numbers and all marks only ever set, so
/// that the order in which rays come does not count.
namespace terracast::labels {

/// 8 x 8 x 8 voxels.
class VoxelBlock {
 public:
  static constexpr int kSide = 8;
  static constexpr std::size_t kVoxels = kSide * kSide * kSide;

  /// Sums of distances, and of how many.
  struct Distances {
    std::array<std::atomic<std::int64_t>, kVoxels> sum{};
    std::array<std::atomic<std::uint32_t>, kVoxels> count{};
  };

  void mark_free(std::size_t voxel) { set(free_, voxel); }
  void mark_occupied(std::size_t voxel) { set(occupied_, voxel); }
  bool is_free(std::size_t voxel) const { return has(free_, voxel); }
  bool is_occupied(std::size_t voxel) const { return has(occupied_, voxel); }
  /// Null: there are none yet.
  Distances* distances() { return distances_.load(std::memory_order_acquire); }
  const Distances* distances() const { return distances_.load(std::memory_order_acquire); }

 private:
  friend class VoxelStore;
  using Marks = std::array<std::atomic<std::uint64_t>, kVoxels / 64>;
  static void set(Marks& marks, std::size_t voxel) {
    const std::uint64_t bit = std::uint64_t{1} << voxel % 64;
    std::atomic<std::uint64_t>& word = marks[voxel / 64];
    if ((word.load(std::memory_order_relaxed) & bit) == 0)
      word.fetch_or(bit, std::memory_order_relaxed);
  }
  static bool has(const Marks& marks, std::size_t voxel) {
    return (marks[voxel / 64].load(std::memory_order_relaxed) >> voxel % 64 & 1U) != 0;
  }

  Marks free_{}, occupied_{};
  std::unique_ptr<Distances> owned_;  ///< made once, under the store's lock
  std::atomic<Distances*> distances_ = nullptr;
};

/// Blocks by place. Threads: safe while rays are told; what is told is read when all have ended.
class VoxelStore {
 public:
  /// What a block takes here and in the file's grids (world/vdb/sparse_grid.h), and what its distances take besides
  /// in two grids: bounds.
  static constexpr std::int64_t kBytesOfBlock = 7000;
  static constexpr std::int64_t kBytesOfDistances = 20000;

  /// most_bytes   that blocks may take
  explicit VoxelStore(double most_bytes) : most_bytes_(most_bytes) {}

  /// For one thread: where it found blocks before.
  class Reader {
   public:
    explicit Reader(VoxelStore& store) : store_(store) {}
    /// throws   Config: the bound is passed
    VoxelBlock& block_of(const Voxel& voxel);
    VoxelBlock::Distances& distances_of(VoxelBlock& block, const Voxel& voxel);

   private:
    static constexpr std::size_t kEntries = 1024;
    struct Entry {
      Voxel place{};
      VoxelBlock* block = nullptr;
    };
    VoxelStore& store_;
    std::vector<Entry> entries_ = std::vector<Entry>(kEntries);
  };

  static std::size_t index_of(const Voxel& voxel) {
    const auto within = [](std::int64_t at) { return static_cast<std::size_t>(at & 7); };
    return (within(voxel[0]) * 8 + within(voxel[1])) * 8 + within(voxel[2]);
  }

  /// All blocks, by their places.
  struct Placed {
    Eigen::Vector3i place;  ///< of its lowest voxel, divided by VoxelBlock::kSide
    const VoxelBlock* block;
  };
  std::vector<Placed> sorted() const;

 private:
  static Voxel block_place(const Voxel& voxel) {
    return {voxel[0] >> 3, voxel[1] >> 3, voxel[2] >> 3};
  }
  void take(std::int64_t num_bytes);

  struct Shard {
    std::mutex mutex;
    std::unordered_map<Voxel, std::unique_ptr<VoxelBlock>, VoxelHash> blocks;
  };
  static constexpr std::size_t kShards = 64;
  /// hash   of a block's place
  Shard& shard_of(std::size_t hash);

  double most_bytes_;
  std::atomic<std::int64_t> num_bytes_ = 0;
  std::array<Shard, kShards> shards_;
};

}  // namespace terracast::labels
