#include "world/scene_cache.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <limits>
#include <new>
#include <tuple>

#include "core/error.h"
#include "core/parallel.h"
#include "core/process_memory.h"
#include "core/stop.h"
#include "core/thread_crew.h"

namespace terracast::world {
namespace {

/// How long to wait for readers to let go of evicted scenes before looking again: about as long as
/// a packet is cast in one tile.
constexpr std::chrono::microseconds kLookAgain{50};
/// And before looking again whether a tile that was loading takes less than what is set aside for it: about as long as
/// one is built.
constexpr std::chrono::milliseconds kLookAgainAtLoads{5};
/// All tiles may be evicted, or all but those needed now.
constexpr std::int64_t kAnyTurn = -1;
constexpr std::int64_t kNow = 0;

/// Of the budget, what packed tiles may take.
constexpr double kShareOfPacked = 0.5;
/// By this share of the budget the process may grow after freed memory was given back to the system, before it is given back
/// again. The first time is when kShareFreed of the budget was freed.
constexpr double kShareOfGrowth = 1.0 / 8.0;
/// The process is measured each time that this share of the budget has been freed.
constexpr double kShareFreed = 1.0 / 16.0;
/// Units in work together may take this share of the budget, at so many bytes each. Their memory counts beside it.
constexpr double kShareOfUnits = 1.0 / 16.0;
constexpr double kUnitBytes = 600e3;
/// With fewer units too few loads are shared, so small budgets get these too.
constexpr int kLeastUnits = 16;
/// Each has a place among the readers while it waits, and a few loops run at once.
constexpr int kMostUnits = 128;

}  // namespace

// How a scene is freed while others look at the cache without a lock. A reader writes the current
// epoch into its place, then reads scene pointers. An evictor clears the pointer, then counts the
// epoch up, then looks at the readers' places (all in one total order). A reader whose place holds
// at least the new epoch has read it after the pointer was cleared; a place that was idle when the
// evictor looked is written, and pointers read, only later. So the scene is unreachable once no
// place holds a smaller epoch.

SceneCache::SceneCache(std::vector<std::size_t> objects_bytes, double budget_bytes, Load load,
                       bool may_be_short)
    : objects_bytes_(std::move(objects_bytes)),
      budget_bytes_(budget_bytes),
      units_paid_for_(static_cast<int>(std::clamp(kShareOfUnits * budget_bytes / kUnitBytes,
                                                  double{kLeastUnits}, double{kMostUnits}))),
      load_(std::move(load)),
      slots_(objects_bytes_.size()),
      is_short_(may_be_short) {}

SceneCache::~SceneCache() {
  if (prefetcher_.joinable()) {
    prefetcher_.request_stop();
    prefetcher_.join();
  }
}

SceneCache::Pin::Pin(SceneCache& cache) : cache_(cache), reader_(nullptr) {
  // A thread finds the place it had last time again, most likely free.
  static thread_local std::size_t place =
      std::hash<std::thread::id>()(std::this_thread::get_id()) % kMaxReaders;
  for (;; place = (place + 1) % kMaxReaders) {
    std::uint64_t idle = kIdle;
    std::atomic<std::uint64_t>& epoch = cache.readers_[place].epoch;
    if (epoch.compare_exchange_strong(idle, cache.epoch_.load())) {
      reader_ = &epoch;
      return;
    }
  }
}

SceneCache::Pin::~Pin() { reader_->store(kIdle, std::memory_order_release); }

void SceneCache::Pin::renew() {
  const std::uint64_t epoch = cache_.epoch_.load();
  if (reader_->load(std::memory_order_relaxed) != epoch) reader_->store(epoch);
}

void SceneCache::Pin::let_go() { reader_->store(kHoldsNothing, std::memory_order_release); }

const TileScene* SceneCache::find(const Pin& pin, std::size_t tile_index) {
  Slot& slot = slots_[tile_index];
  const std::uint64_t epoch = pin.reader_->load(std::memory_order_relaxed);
  if (slot.last_used.load(std::memory_order_relaxed) < epoch)
    slot.last_used.store(epoch, std::memory_order_relaxed);
  return slot.scene.load();
}

const TileScene& SceneCache::load(Pin& pin, std::size_t tile_index) {
  for (;;) {
    pin.renew();
    if (const TileScene* scene = find(pin, tile_index)) return *scene;
    pin.let_go();
    if (begin_load(tile_index)) return finish_load(tile_index, &pin);
  }
}

/// A unit's turn on this thread, from when it has a processor.
class SceneCache::Turn {
 public:
  explicit Turn(SceneCache& cache) : cache_(cache) {
    std::unique_lock lock(cache_.mutex_);
    cache_.turns_.start(unit_);
    wait(lock);
    current() = this;
  }
  ~Turn() {
    current() = nullptr;
    const std::lock_guard lock(cache_.mutex_);
    cache_.turns_.finish();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

  /// The turn of the unit that this thread runs with a cache; null: none.
  static Turn* of(const SceneCache& cache) {
    return current() != nullptr && &current()->cache_ == &cache ? current() : nullptr;
  }

  UnitTurns::Unit& unit() { return unit_; }
  void wait(std::unique_lock<std::mutex>& lock) {
    unit_.ordered.wait(lock, [&] { return unit_.order != UnitTurns::Unit::Order::Wait; });
  }

 private:
  static Turn*& current() {
    static thread_local Turn* turn = nullptr;
    return turn;
  }

  SceneCache& cache_;
  UnitTurns::Unit unit_;
};

void SceneCache::run_units(std::int64_t count, const std::function<void(std::int64_t)>& body) {
  if (Turn::of(*this) != nullptr) {
    // Other threads would have no turn to give up while they wait for room.
    for (std::int64_t i = 0; i < count; ++i) body(i);
    return;
  }
  if (!is_short_ && !was_short_) {
    core::parallel_for_blocks(count, 1, [&](std::int64_t i, std::int64_t) { body(i); });
    return;
  }
  const int num_processors = core::num_threads_allowed();
  {
    const std::lock_guard lock(mutex_);
    turns_.set_num_processors(num_processors);
  }
  const int units_at_once = std::clamp(2 * num_processors, units_paid_for_, kMostUnits);
  core::parallel_for_on_threads(count, units_at_once, [&](std::int64_t i) {
    const Turn turn(*this);
    core::throw_if_stop_asked();  // meanwhile
    body(i);
  });
}

SceneCache::Loaded SceneCache::load_one_of(Pin& pin, std::span<const TileDemand> demands) {
  Turn* const turn = Turn::of(*this);
  if (turn == nullptr) return {demands[0].tile_index, &load(pin, demands[0].tile_index)};
  const auto use = [&](std::size_t tile_index) -> Loaded {
    pin.renew();  // before anybody can evict it
    Slot& slot = slots_[tile_index];
    slot.last_used.store(epoch_.load(), std::memory_order_relaxed);
    return {tile_index, slot.owned.get()};
  };
  pin.let_go();
  std::unique_lock lock(mutex_);
  for (const TileDemand& demand : demands)
    if (slots_[demand.tile_index].owned || take_back(demand.tile_index))
      return use(demand.tile_index);
  turns_.wait(turn->unit(), demands);
  turn->wait(lock);
  const std::size_t tile_index = turn->unit().tile_index;
  if (turn->unit().order == UnitTurns::Unit::Order::Use) {
    const Loaded loaded = use(tile_index);
    turns_.keep_promise(tile_index);
    TERRACAST_CHECK(loaded.scene != nullptr, "tile {} was promised and evicted", tile_index);
    return loaded;
  }
  lock.unlock();
  return {tile_index, &load(pin, tile_index)};
}

void SceneCache::let_others_run(std::unique_lock<std::mutex>& lock) {
  Turn* const turn = Turn::of(*this);
  if (turn == nullptr) return;
  // They hold the room, and may need this unit's processor to get on.
  turns_.finish();
  turns_.start(turn->unit());
  turn->wait(lock);
}

bool SceneCache::begin_load(std::size_t tile_index) {
  Slot& slot = slots_[tile_index];
  Freed freed;
  std::unique_lock lock(mutex_);
  for (;;) {
    loaded_.wait(lock, [&] { return !slot.is_loading; });
    if (slot.owned || take_back(tile_index)) return false;
    const Room room = take_room(tile_index, kAnyTurn, freed);
    if (room == Room::Taken) break;
    if (room != Room::BeingFreed) let_others_run(lock);
    lock.unlock();
    if (room == Room::BeingFreed)
      put_away(freed);
    else
      std::this_thread::sleep_for(kLookAgain);
    lock.lock();
  }
  slot.is_loading = true;
  turns_.begin_load(tile_index);
  lock.unlock();
  put_away(freed);
  return true;
}

const TileScene& SceneCache::finish_load(std::size_t tile_index, Pin* pin) {
  Slot& slot = slots_[tile_index];
  std::unique_ptr<const PackedTile> packed;
  {
    const std::lock_guard lock(mutex_);
    packed = std::move(slot.packed);
  }
  const std::uint64_t packed_bytes = packed != nullptr ? packed->num_bytes() : 0;
  std::unique_ptr<const TileScene> scene;
  try {
    scene = load_(tile_index, packed.get());
    TERRACAST_CHECK(scene->num_bytes() <= slot.bytes_set_aside, "a tile of {} bytes, {} foreseen",
                    scene->num_bytes(), slot.bytes_set_aside);
  } catch (...) {
    give_up_load(tile_index, std::move(packed));
    throw;
  }
  const bool is_unpacked = packed != nullptr;
  packed.reset();
  const TileScene& result = *scene;
  {
    const std::lock_guard lock(mutex_);
    if (pin != nullptr) pin->renew();  // before anybody can evict it
    slot.is_loading = false;
    bytes_loading_ -= slot.bytes_set_aside;
    bytes_packed_ -= packed_bytes;
    stats_.bytes_resident -= packed_bytes;
    slot.scene_bytes = result.num_bytes();
    slot.owned = std::move(scene);
    slot.scene.store(slot.owned.get());
    const std::uint64_t epoch = epoch_.fetch_add(1) + 1;
    const std::uint64_t used_at = pin != nullptr ? epoch : expected_at_;
    if (slot.last_used.load(std::memory_order_relaxed) < used_at)
      slot.last_used.store(used_at, std::memory_order_relaxed);
    ++stats_.num_loaded;
    if (is_unpacked) ++stats_.num_unpacked;
    add_resident(result.num_bytes());
    turns_.arrive(tile_index);
    if (pin != nullptr || turns_.is_promised(tile_index)) ++stats_.num_waited;
  }
  loaded_.notify_all();
  return result;
}

void SceneCache::give_up_load(std::size_t tile_index, std::unique_ptr<const PackedTile> packed) {
  {
    const std::lock_guard lock(mutex_);
    Slot& slot = slots_[tile_index];
    slot.is_loading = false;
    slot.packed = std::move(packed);
    bytes_loading_ -= slot.bytes_set_aside;
    turns_.give_up_load(tile_index);
  }
  loaded_.notify_all();
}

void SceneCache::add_resident(std::uint64_t bytes) {
  stats_.bytes_resident += bytes;
  stats_.peak_bytes_resident = std::max(stats_.peak_bytes_resident, stats_.bytes_resident);
}

std::size_t SceneCache::bytes_to_set_aside(std::size_t tile_index) const {
  const Slot& slot = slots_[tile_index];
  if (slot.packed != nullptr) return TileScene::kMostBytesWhileUnpacking + slot.scene_bytes;
  return slot.scene_bytes != 0
             ? TileScene::most_bytes_while_loading(objects_bytes_[tile_index], slot.scene_bytes)
             : TileScene::most_bytes_while_loading(objects_bytes_[tile_index]);
}

bool SceneCache::fits(std::size_t bytes, std::uint64_t bytes_held) const {
  return static_cast<double>(bytes + bytes_held + bytes_loading_) <= budget_bytes_ ||
         (bytes_held == 0 && bytes_loading_ == 0);
}

SceneCache::Room SceneCache::take_room(std::size_t tile_index, std::int64_t after_turn,
                                       Freed& freed) {
  for (;;) {
    free_unpinned(freed);
    const std::size_t bytes = bytes_to_set_aside(tile_index);
    if (fits(bytes, stats_.bytes_resident)) {
      slots_[tile_index].bytes_set_aside = bytes;
      bytes_loading_ += bytes;
      return Room::Taken;
    }
    if (!freed.empty()) return Room::BeingFreed;
    if (fits(bytes, stats_.bytes_resident - bytes_retired_)) return Room::HeldByReaders;
    // What is packed and needed now goes last: it is small, and takes longest to come back.
    if (drop_packed(std::max(after_turn, kNow), tile_index) || evict_one(after_turn) ||
        drop_packed(after_turn, tile_index))
      continue;
    if (bytes_retired_ > 0 || turns_.has_promises()) return Room::HeldByReaders;
    if (bytes_loading_ > 0) return Room::HeldByLoads;
    // Nothing else is left: what the tile itself is packed in may be what it lacks room for.
    if (after_turn == kAnyTurn && slots_[tile_index].packed != nullptr) {
      forget_packed(slots_[tile_index]);
      continue;
    }
    return Room::None;
  }
}

template <class Takes>
std::size_t SceneCache::needed_latest(std::int64_t after_turn, const Takes& takes) const {
  const auto order_of = [&](const Slot& slot) {
    return std::tuple(turn_of(slot), ~slot.last_used.load(std::memory_order_relaxed));
  };
  std::size_t latest = slots_.size();
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (!takes(i)) continue;
    if (latest == slots_.size() || order_of(slots_[i]) > order_of(slots_[latest])) latest = i;
  }
  return latest < slots_.size() && turn_of(slots_[latest]) > after_turn ? latest : slots_.size();
}

bool SceneCache::drop_packed(std::int64_t after_turn, std::size_t kept_tile_index) {
  const std::size_t latest = needed_latest(after_turn, [&](std::size_t i) {
    return slots_[i].packed != nullptr && !slots_[i].is_loading && i != kept_tile_index;
  });
  if (latest == slots_.size()) return false;
  forget_packed(slots_[latest]);
  return true;
}

void SceneCache::forget_packed(Slot& slot) {
  const std::uint64_t bytes = slot.packed->num_bytes();
  bytes_packed_ -= bytes;
  stats_.bytes_resident -= bytes;
  bytes_freed_ += bytes;
  slot.packed.reset();
}

bool SceneCache::evict_one(std::int64_t after_turn) {
  const std::size_t latest = needed_latest(after_turn, [&](std::size_t i) {
    return slots_[i].owned != nullptr && !turns_.is_promised(i);
  });
  if (latest == slots_.size()) return false;
  Slot& slot = slots_[latest];
  if (turn_of(slot) == 0) is_short_ = true;
  slot.scene.store(nullptr);
  bytes_retired_ += slot.owned->num_bytes();
  retired_.push_back(
      {.epoch = epoch_.fetch_add(1) + 1, .tile_index = latest, .scene = std::move(slot.owned)});
  if (stats_.num_evicted++ == 0)
    stats_.bytes_at_first_eviction = stats_.bytes_resident + bytes_loading_;
  return true;
}

bool SceneCache::take_back(std::size_t tile_index) {
  const auto found = std::find_if(retired_.begin(), retired_.end(), [&](const Retired& retired) {
    return retired.tile_index == tile_index;
  });
  if (found == retired_.end()) return false;
  Slot& slot = slots_[tile_index];
  slot.owned = std::move(found->scene);
  retired_.erase(found);
  bytes_retired_ -= slot.owned->num_bytes();
  slot.scene.store(slot.owned.get());
  epoch_.fetch_add(1);
  turns_.arrive(tile_index);
  return true;
}

void SceneCache::free_unpinned(Freed& freed) {
  if (retired_.empty()) return;
  std::uint64_t oldest = epoch_.load();
  for (const Reader& reader : readers_) {
    const std::uint64_t epoch = reader.epoch.load();
    if (epoch != kIdle) oldest = std::min(oldest, epoch);
  }
  const auto first = std::partition(retired_.begin(), retired_.end(),
                                    [&](const Retired& retired) { return retired.epoch > oldest; });
  for (auto retired = first; retired != retired_.end(); ++retired) {
    bytes_retired_ -= retired->scene->num_bytes();
    freed.push_back(std::move(*retired));
  }
  retired_.erase(first, retired_.end());
}

void SceneCache::put_away(Freed& freed) {
  if (freed.empty()) return;
  for (Retired& retired : freed) {
    const std::uint64_t bytes = retired.scene->num_bytes();
    // A bare tile is built from its file nearly as fast: most of it is Embree's build.
    std::unique_ptr<const PackedTile> packed;
    if (retired.scene->objects() != nullptr) try {
        packed = std::make_unique<const PackedTile>(retired.scene->packed());
      } catch (const std::exception&) {
        // It comes from its file again, and its bytes must be subtracted below, whatever failed.
      }
    retired.scene.reset();
    bytes_freed_ += bytes;
    const std::uint64_t packed_bytes = packed != nullptr ? packed->num_bytes() : 0;
    const std::lock_guard lock(mutex_);
    stats_.bytes_resident -= bytes;
    if (packed == nullptr) continue;
    Slot& slot = slots_[retired.tile_index];
    const auto has_room = [&] {
      return static_cast<double>(bytes_packed_ + packed_bytes) <= kShareOfPacked * budget_bytes_;
    };
    while (!has_room() && drop_packed(kNow, retired.tile_index)) {
    }
    if (!has_room() || slot.owned || slot.packed || slot.is_loading) continue;
    slot.packed = std::move(packed);
    bytes_packed_ += packed_bytes;
    add_resident(packed_bytes);
  }
  freed.clear();
  hold_growth();
}

void SceneCache::hold_growth() {
  std::uint64_t bytes = bytes_freed_.load();
  if (static_cast<double>(bytes) < kShareFreed * budget_bytes_) return;
  if (!bytes_freed_.compare_exchange_strong(bytes, 0)) return;
  const double resident_bytes = core::resident_bytes();  // 0: unknown
  if (resident_bytes > 0.0 && resident_bytes < most_resident_bytes_) return;
  core::give_freed_memory_back();
  most_resident_bytes_ = std::max(most_resident_bytes_.load(),
                                  core::resident_bytes() + kShareOfGrowth * budget_bytes_);
}

void SceneCache::expect(std::vector<Expected> tiles) {
  const std::lock_guard lock(prefetch_mutex_);
  {
    const std::lock_guard cache_lock(mutex_);
    for (Slot& slot : slots_) {
      slot.next_turn = is_used(slot) ? 0 : kNever;
    }
    for (const Expected& tile : tiles)
      slots_[tile.tile_index].next_turn = std::min(slots_[tile.tile_index].next_turn, tile.turn);
    // Before the epoch of anything that is used from now on.
    expected_at_ = epoch_.fetch_add(1);
    was_short_ = is_short_.exchange(false);
  }
  std::erase_if(
      tiles, [&](const Expected& tile) { return slots_[tile.tile_index].scene.load() != nullptr; });
  expected_ = std::move(tiles);
  is_expected_new_ = true;
  if (expected_.empty()) return;
  if (!prefetcher_.joinable())
    prefetcher_ = std::jthread([this](const std::stop_token& stop) { prefetch_loop(stop); });
  prefetch_asked_.notify_one();
}

void SceneCache::prefetch_loop(const std::stop_token& stop) {
  std::size_t next = 0;
  while (!stop.stop_requested()) {
    Expected tile{};
    {
      std::unique_lock lock(prefetch_mutex_);
      const auto has_work = [&] { return is_expected_new_ || next < expected_.size(); };
      if (!prefetch_asked_.wait(lock, stop, has_work)) return;
      if (is_expected_new_) next = 0;
      is_expected_new_ = false;
      if (next >= expected_.size()) continue;
      tile = expected_[next];
    }
    switch (prefetch(tile)) {
      case Room::Taken:
        ++next;
        break;
      case Room::BeingFreed:
        break;
      case Room::HeldByReaders:
        std::this_thread::sleep_for(kLookAgain);
        break;
      case Room::HeldByLoads:
        std::this_thread::sleep_for(kLookAgainAtLoads);
        break;
      case Room::None:  // until something else is expected
        next = std::numeric_limits<std::size_t>::max();
    }
  }
}

SceneCache::Room SceneCache::prefetch(const Expected& tile) {
  Slot& slot = slots_[tile.tile_index];
  Freed freed;
  Room room = Room::None;
  {
    const std::lock_guard lock(mutex_);
    if (slot.owned || slot.is_loading || take_back(tile.tile_index)) return Room::Taken;
    room = take_room(tile.tile_index, tile.turn, freed);
    if (room == Room::Taken) {
      slot.is_loading = true;
      turns_.begin_load(tile.tile_index);
    }
  }
  put_away(freed);
  if (room != Room::Taken) return room;
  try {
    finish_load(tile.tile_index, nullptr);
  } catch (const std::exception&) {  // the ray that needs it will say what is wrong
  }
  return Room::Taken;
}

SceneCache::Stats SceneCache::stats() const {
  const std::lock_guard lock(mutex_);
  return stats_;
}

}  // namespace terracast::world
