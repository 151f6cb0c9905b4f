#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <vector>

namespace terracast::world {

/// Rays that wait for a tile.
struct TileDemand {
  std::size_t tile_index;
  std::uint64_t num_rays;
};

/// Schedules units of work that trace rays, of which many more are in work than there are processors. A unit
/// whose rays all wait for tiles gives its processor to another unit. A processor loads a tile when no
/// unit that waits can go on without: the one for which most rays wait, of all units together. So one load serves the
/// rays of many units.
///
/// Threads: none of it is safe; one mutex, the one that the units wait with, guards all calls.
class UnitTurns {
 public:
  struct Unit {
    enum class Order {
      Wait,  ///< it has no processor
      Run,   ///< from its start, or from where it queued again
      Use,   ///< go on in the tile, which is loaded
      Load,  ///< load the tile, then go on in it
    };
    Order order = Order::Wait;
    std::size_t tile_index = 0;
    std::condition_variable ordered;  ///< notified when it no longer waits

   private:
    friend class UnitTurns;
    Order next = Order::Run;
    std::vector<TileDemand> demands;
  };

  /// Units that run at once from now on.
  void set_num_processors(int num_processors);

  /// Queues a unit that waits for no tile.
  void start(Unit& unit);
  /// Ends a unit that has a processor.
  void finish();
  /// Takes the processor of a unit until one of the tiles is there, or until it is the one to load it.
  /// demands   one at least; none of the tiles is loaded
  void wait(Unit& unit, std::span<const TileDemand> demands);

  /// A tile is being loaded, by a unit or otherwise.
  void begin_load(std::size_t tile_index);
  /// No load of the tile is under way any more: it failed, or the tile is there.
  void give_up_load(std::size_t tile_index);
  /// A tile is there: it is promised to the units that wait for it.
  void arrive(std::size_t tile_index);
  /// A unit with the order Use has pinned its tile.
  void keep_promise(std::size_t tile_index);
  /// Whether a tile must stay for units that will use it.
  bool is_promised(std::size_t tile_index) const { return promises_.contains(tile_index); }
  bool has_promises() const { return !promises_.empty(); }

 private:
  struct Awaited {
    std::uint64_t num_rays = 0;
    bool is_loading = false;
  };

  void dispatch();
  void withdraw(Unit& unit);

  int num_processors_ = 1;
  int num_running_ = 0;
  std::deque<Unit*> ready_;
  std::vector<Unit*> waiting_;
  std::map<std::size_t, Awaited> awaited_;  ///< tiles that are waited for or loading
  std::map<std::size_t, int> promises_;     ///< units that will use a tile
};

}  // namespace terracast::world
