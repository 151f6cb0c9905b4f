#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "world/embree_scene.h"

namespace terracast::world {

/// The loaded tiles of a cut, within a byte budget.
///
/// Readers pin the cache while they use a scene: what is evicted in the meantime lives until they
/// are done, and counts until then. A tile is loaded only when there is room for it, for what its
/// loading needs beside it, and for all that is loaded, loading or still held: room is made by
/// evicting the tile needed latest (as foretold by expect; among equals the one used longest ago), or
/// waited for. So the budget is never passed; a budget too small for a single tile holds one.
///
/// Threads: safe. Finding a loaded tile takes no lock; different tiles load in parallel, each once.
class SceneCache {
 public:
  using Load = std::function<std::unique_ptr<const TileScene>(std::size_t tile_index)>;

  /// bytes_while_loading   of each tile, what is set aside for it while it is loaded; it keeps no more
  SceneCache(std::vector<std::size_t> bytes_while_loading, double budget_bytes, Load load);
  ~SceneCache();
  SceneCache(const SceneCache&) = delete;
  SceneCache& operator=(const SceneCache&) = delete;

  /// Scenes found or loaded under a pin stay alive until it is renewed or destroyed. A thread that
  /// loads under one pin must hold no other.
  class Pin {
   public:
    explicit Pin(SceneCache& cache);
    ~Pin();
    Pin(const Pin&) = delete;
    Pin& operator=(const Pin&) = delete;
    /// Lets go of all scenes got so far; find is next.
    void renew();

   private:
    friend class SceneCache;
    /// Lets go of all scenes, for a while without find.
    void let_go();

    SceneCache& cache_;
    std::atomic<std::uint64_t>* reader_;
  };

  /// The scene of a tile; null when it is not loaded.
  const TileScene* find(const Pin& pin, std::size_t tile_index);
  /// The scene of a tile, loaded when it is not there. Renews the pin.
  /// throws   what Load throws; the next one who asks tries again
  const TileScene& load(Pin& pin, std::size_t tile_index);

  /// A tile that will be needed.
  struct Expected {
    std::uint32_t tile_index;
    std::uint32_t turn;  ///< how soon: 0 now, 1 after that, …
  };
  /// What will be needed, soonest first; beside it all tiles that were used since the last call count
  /// as needed now. Loads what is missing on a thread of its own, in this order, as far as there is
  /// room beside what is needed no later. Replaces what was expected before. A tile that cannot be
  /// loaded is left for the ray that needs it to report.
  void expect(std::vector<Expected> tiles);

  struct Stats {
    std::uint64_t num_loaded = 0;
    std::uint64_t num_waited = 0;
    std::uint64_t num_evicted = 0;
    std::uint64_t bytes_resident = 0;
    std::uint64_t peak_bytes_resident = 0;
  };
  Stats stats() const;

 private:
  static constexpr std::uint64_t kIdle = 0;  ///< a reader's place that is free
  static constexpr std::uint64_t kHoldsNothing = std::numeric_limits<std::uint64_t>::max();
  static constexpr std::size_t kMaxReaders = 512;
  static constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();
  struct alignas(64) Reader {
    std::atomic<std::uint64_t> epoch = kIdle;
  };
  struct Slot {
    std::atomic<const TileScene*> scene = nullptr;
    std::atomic<std::uint64_t> last_used = 0;
    std::unique_ptr<const TileScene> owned;  // the rest: under mutex_
    bool is_loading = false;
    std::uint32_t next_turn = kNever;
  };
  struct Retired {
    std::uint64_t epoch;
    std::size_t tile_index;
    std::unique_ptr<const TileScene> scene;
  };
  using Freed = std::vector<Retired>;
  enum class Room { Taken, HeldByReaders, None };

  /// Marks a tile as loading once there is room; false when it is loaded by then.
  bool begin_load(std::size_t tile_index);
  /// Loads a tile that is marked as loading.
  /// pin   will hold the scene; null: nobody waits for it
  const TileScene& finish_load(std::size_t tile_index, Pin* pin);
  void give_up_load(std::size_t tile_index);

  // Under mutex_.
  /// Takes room for a tile to be loaded, evicting what is needed after this turn.
  /// freed   to be destroyed without mutex_
  Room take_room(std::size_t tile_index, std::int64_t after_turn, Freed& freed);
  /// Whether a tile fits beside what is held and loading.
  bool fits(std::size_t tile_index, std::uint64_t bytes_held) const;
  bool evict_one(std::int64_t after_turn);
  void free_unpinned(Freed& freed);
  /// Puts the scene of a tile back that was evicted but is still alive; false when there is none.
  bool take_back(std::size_t tile_index);

  void prefetch_loop(const std::stop_token& stop);
  /// Loads a tile unless that would evict what is needed no later.
  /// returns   Taken: it is loaded, or being loaded
  Room prefetch(const Expected& tile);

  const std::vector<std::size_t> bytes_while_loading_;
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
  std::uint64_t bytes_retired_ = 0;
  std::uint64_t bytes_loading_ = 0;  ///< set aside for tiles that are loading
  std::uint64_t expected_at_ = 0;    ///< epoch of the last call of expect

  std::mutex prefetch_mutex_;
  std::condition_variable_any prefetch_asked_;
  std::vector<Expected> expected_;
  bool is_expected_new_ = false;
  std::jthread prefetcher_;  // last: it uses the rest
};

}  // namespace terracast::world
