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
#include <span>
#include <thread>
#include <vector>

#include "world/embree_scene.h"
#include "world/unit_turns.h"

namespace terracast::world {

/// The loaded tiles of a cut, within a byte budget.
///
/// Readers pin the cache while they use a scene: what is evicted in the meantime lives until they
/// are done, and counts until then. A tile is loaded only when there is room for it, for what its
/// loading needs beside it, and for all that is loaded, loading or still held: room is made by
/// evicting the tile needed latest (as foretold by expect; among equals the one used longest ago), or
/// waited for. So the budget is never passed. A tile with objects that is evicted stays packed, in up to
/// half of the budget, and is then built again without its file.
///
/// Threads: safe. Finding a loaded tile takes no lock; different tiles load in parallel, each once.
class SceneCache {
 public:
  /// packed   null: from its file
  using Load = std::function<std::unique_ptr<const TileScene>(std::size_t tile_index,
                                                              const PackedTile* packed)>;

  /// objects_bytes   of each tile, in its file: for what is set aside while it is loaded
  /// budget_bytes    as much as the most that is set aside for one of them
  /// may_be_short    true: units take turns (run_units) from the start
  SceneCache(std::vector<std::size_t> objects_bytes, double budget_bytes, Load load,
             bool may_be_short = false);
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
    /// Lets go of all scenes got so far; called before find().
    void renew();

   private:
    friend class SceneCache;
    /// Holds nothing until the next renew(); find() must not be called in between.
    void let_go();

    SceneCache& cache_;
    std::atomic<std::uint64_t>* reader_;
  };

  /// The scene of a tile; null when it is not loaded.
  const TileScene* find(const Pin& pin, std::size_t tile_index);
  /// The scene of a tile, loaded when it is not there. Renews the pin.
  /// throws   what Load throws; the next one who asks tries again
  const TileScene& load(Pin& pin, std::size_t tile_index);

  struct Loaded {
    std::size_t tile_index;
    const TileScene* scene;
  };
  /// One of several tiles, which is loaded already or is loaded now; the first of them outside of
  /// run_units. Renews the pin.
  /// demands   the tiles, the one needed first to begin with
  Loaded load_one_of(Pin& pin, std::span<const TileDemand> demands);

  /// Calls body(i) for each i in [0, count) as core::parallel_for. When tiles that are needed now were
  /// evicted lately, more bodies are in work than processors, and take turns (UnitTurns): one that waits in load_one_of()
  /// lets others run, so that a tile is loaded for the rays of many.
  void run_units(std::int64_t count, const std::function<void(std::int64_t)>& body);

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
    std::uint64_t num_loaded = 0;    ///< from files or packed
    std::uint64_t num_unpacked = 0;  ///< of these from packed
    std::uint64_t num_waited = 0;    ///< of these those that a ray waited for
    std::uint64_t num_evicted = 0;
    std::uint64_t bytes_resident = 0;  ///< packed ones included
    std::uint64_t peak_bytes_resident = 0;
    /// Held and set aside when a tile was evicted for the first time; 0: none was.
    std::uint64_t bytes_at_first_eviction = 0;
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
    std::unique_ptr<const PackedTile> packed;
    std::size_t scene_bytes = 0;      ///< of the scene as it was last; 0: it has not been loaded
    std::size_t bytes_set_aside = 0;  ///< while it is loading
    bool is_loading = false;
    std::uint32_t next_turn = kNever;
  };
  struct Retired {
    std::uint64_t epoch;
    std::size_t tile_index;
    std::unique_ptr<const TileScene> scene;
  };
  using Freed = std::vector<Retired>;
  /// BeingFreed: what has been freed must be put away first. HeldByReaders: by readers, or for units that it is
  /// promised to. HeldByLoads: set aside for tiles that are loading, which may turn out smaller.
  enum class Room { Taken, BeingFreed, HeldByReaders, HeldByLoads, None };
  class Turn;

  /// Where this thread runs a unit: gives its processor up for a while.
  void let_others_run(std::unique_lock<std::mutex>& lock);
  /// Marks a tile as loading once there is room; false when it is loaded by then.
  bool begin_load(std::size_t tile_index);
  /// Loads a tile that is marked as loading.
  /// pin   will hold the scene; null: nobody waits for it
  const TileScene& finish_load(std::size_t tile_index, Pin* pin);
  void give_up_load(std::size_t tile_index, std::unique_ptr<const PackedTile> packed);

  // Under mutex_.
  /// Takes room for a tile to be loaded, evicting what is needed after this turn.
  /// freed   to be given to put_away
  Room take_room(std::size_t tile_index, std::int64_t after_turn, Freed& freed);
  /// What is set aside for a tile while it is loaded.
  std::size_t bytes_to_set_aside(std::size_t tile_index) const;
  /// Whether so much fits beside what is held and loading.
  bool fits(std::size_t bytes, std::uint64_t bytes_held) const;
  bool is_used(const Slot& slot) const {
    return slot.last_used.load(std::memory_order_relaxed) > expected_at_;
  }
  /// How soon a tile is needed: what was used since the last call of expect will be needed again.
  std::uint32_t turn_of(const Slot& slot) const { return is_used(slot) ? 0 : slot.next_turn; }
  /// The slot needed latest of those that a predicate takes, if it is needed after a turn; else the end.
  template <class Takes>
  std::size_t needed_latest(std::int64_t after_turn, const Takes& takes) const;
  bool evict_one(std::int64_t after_turn);
  /// Drops a packed tile, but not this one.
  bool drop_packed(std::int64_t after_turn, std::size_t kept_tile_index);
  void forget_packed(Slot& slot);
  void free_unpinned(Freed& freed);
  void add_resident(std::uint64_t bytes);
  /// Puts the scene of a tile back that was evicted but is still alive; false when there is none.
  bool take_back(std::size_t tile_index);

  /// Packs or destroys freed scenes, whose bytes count until then. Not under mutex_.
  void put_away(Freed& freed);
  /// Gives freed memory back to the system, which malloc would keep in pieces, when the process has grown by more than
  /// kShareOfGrowth of the budget since that was last done: so far the process may take more than the budget.
  void hold_growth();

  void prefetch_loop(const std::stop_token& stop);
  /// Loads a tile unless that would evict what is needed no later.
  /// returns   Taken: it is loaded, or being loaded
  Room prefetch(const Expected& tile);

  const std::vector<std::size_t> objects_bytes_;
  const double budget_bytes_;
  const int units_paid_for_;  ///< units in work whose memory is a small part of the budget
  const Load load_;
  std::vector<Slot> slots_;
  std::array<Reader, kMaxReaders> readers_;
  /// Counts evictions and loads; a reader's value says since when it may hold scenes.
  std::atomic<std::uint64_t> epoch_ = 1;

  mutable std::mutex mutex_;
  std::condition_variable loaded_;
  std::vector<Retired> retired_;
  Stats stats_;
  UnitTurns turns_;
  std::uint64_t bytes_retired_ = 0;
  std::uint64_t bytes_packed_ = 0;
  std::uint64_t bytes_loading_ = 0;             ///< set aside for tiles that are loading
  std::uint64_t expected_at_ = 0;               ///< epoch of the last call of expect
  std::atomic<std::uint64_t> bytes_freed_ = 0;  ///< since hold_growth() looked
  std::atomic<double> most_resident_bytes_ = 0.0;
  std::atomic<bool>
      is_short_;  ///< a tile that is needed now was evicted since the last call of expect
  std::atomic<bool> was_short_ = false;  ///< or before that since the one before

  std::mutex prefetch_mutex_;
  std::condition_variable_any prefetch_asked_;
  std::vector<Expected> expected_;
  bool is_expected_new_ = false;
  std::jthread prefetcher_;  // last: it uses the rest
};

}  // namespace terracast::world
