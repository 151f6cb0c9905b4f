#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "world/embree_scene.h"

namespace terracast::world {

/// The loaded tiles of a cut, by byte budget: when a tile is loaded and the budget is passed, those
/// used longest ago go.
///
/// Readers pin the cache while they use scenes: what is evicted in the meantime lives until they
/// are done. So memory may pass the budget by the tiles that the pins at work hold: those of one
/// batch of rays a thread. Threads: safe. Looking up a loaded tile takes no lock; different tiles load
/// in parallel, each once.
class SceneCache {
 public:
  using Load = std::function<std::unique_ptr<const TileScene>(std::size_t tile_index)>;

  SceneCache(std::size_t num_tiles, double budget_bytes, Load load);
  ~SceneCache();
  SceneCache(const SceneCache&) = delete;
  SceneCache& operator=(const SceneCache&) = delete;

  /// Scenes got under a pin stay alive until it is renewed or destroyed.
  class Pin {
   public:
    explicit Pin(SceneCache& cache);
    ~Pin();
    Pin(const Pin&) = delete;
    Pin& operator=(const Pin&) = delete;
    /// Lets go of all scenes got so far.
    void renew();

   private:
    friend class SceneCache;
    SceneCache& cache_;
    std::atomic<std::uint64_t>* reader_;
  };

  /// The scene of a tile, loaded when it is not there.
  /// throws   what Load throws; the next one who asks tries again
  const TileScene& get(const Pin& pin, std::size_t tile_index);

  /// Loads these tiles on a thread of its own, in this order, until the budget is used up; replaces
  /// what was asked before. A tile that cannot be loaded is left for the ray that needs it to
  /// report.
  void prefetch(std::vector<std::uint32_t> tile_indices);

  struct Stats {
    std::uint64_t num_loaded = 0;
    std::uint64_t num_waited = 0;
    std::uint64_t num_evicted = 0;
    std::uint64_t bytes_resident = 0;
    std::uint64_t peak_bytes_resident = 0;
  };
  Stats stats() const;

 private:
  static constexpr std::uint64_t kIdle = 0;
  static constexpr std::size_t kMaxReaders = 512;
  struct alignas(64) Reader {
    std::atomic<std::uint64_t> epoch = kIdle;
  };
  struct Slot {
    std::atomic<const TileScene*> scene = nullptr;
    std::atomic<std::uint64_t> last_used = 0;
    std::unique_ptr<const TileScene> owned;  // the rest: under mutex_
    bool is_loading = false;
  };
  struct Retired {
    std::uint64_t epoch;
    std::size_t tile_index;
    std::unique_ptr<const TileScene> scene;
  };

  const TileScene& load(std::size_t tile_index, bool for_ray);
  void evict_down_to_budget(std::size_t keep);
  std::vector<Retired> take_unpinned();
  /// Puts the scene of a tile back that was evicted but is still alive; false when there is none.
  bool take_back(std::size_t tile_index);
  void prefetch_loop(const std::stop_token& stop);

  const double budget_bytes_;
  const Load load_;
  std::vector<Slot> slots_;
  std::array<Reader, kMaxReaders> readers_;
  /// Counts evictions and loads; a reader's value says since when it may hold scenes.
  std::atomic<std::uint64_t> epoch_ = 1;

  mutable std::mutex mutex_;
  std::condition_variable loaded_;
  std::vector<Retired> retired_;
  Stats stats_;
  std::uint64_t typical_bytes_ = 0;  ///< of the tile loaded last

  std::mutex prefetch_mutex_;
  std::condition_variable_any prefetch_asked_;
  std::vector<std::uint32_t> to_prefetch_;
  bool has_prefetch_ = false;
  std::jthread prefetcher_;  // last: it uses the rest
};

}  // namespace terracast::world
