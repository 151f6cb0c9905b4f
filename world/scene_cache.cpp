#include "world/scene_cache.h"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <limits>
#include <tuple>

#include "core/error.h"

namespace terracast::world {
namespace {

/// How long to wait for readers to let go of evicted scenes before looking again: about as long as
/// a packet is cast in one tile.
constexpr std::chrono::microseconds kLookAgain{50};
/// All tiles may be evicted.
constexpr std::int64_t kAnyTurn = -1;

/// Frees scenes and gives their memory back to the system, which malloc would keep in pieces: the
/// budget bounds what the process takes.
template <class Scenes>
void give_back(Scenes& scenes) {
  if (scenes.empty()) return;
  scenes.clear();
  malloc_trim(0);
}

}  // namespace

// How a scene is freed while others look at the cache without a lock. A reader writes the current
// epoch into its place, then reads scene pointers. An evictor clears the pointer, then counts the
// epoch up, then looks at the readers' places (all in one total order). A reader whose place holds
// at least the new epoch has read it after the pointer was cleared; a place that was idle when the
// evictor looked is written, and pointers read, only later. So the scene is unreachable once no
// place holds a smaller epoch.

SceneCache::SceneCache(std::vector<std::size_t> bytes_while_loading, double budget_bytes, Load load)
    : bytes_while_loading_(std::move(bytes_while_loading)),
      budget_bytes_(budget_bytes),
      load_(std::move(load)),
      slots_(bytes_while_loading_.size()) {}

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

bool SceneCache::begin_load(std::size_t tile_index) {
  Slot& slot = slots_[tile_index];
  Freed freed;
  std::unique_lock lock(mutex_);
  ++stats_.num_waited;
  for (;;) {
    loaded_.wait(lock, [&] { return !slot.is_loading; });
    if (slot.owned || take_back(tile_index)) return false;
    if (take_room(tile_index, kAnyTurn, freed) == Room::Taken) break;
    lock.unlock();
    give_back(freed);
    std::this_thread::sleep_for(kLookAgain);
    lock.lock();
  }
  slot.is_loading = true;
  lock.unlock();
  give_back(freed);
  return true;
}

const TileScene& SceneCache::finish_load(std::size_t tile_index, Pin* pin) {
  Slot& slot = slots_[tile_index];
  std::unique_ptr<const TileScene> scene;
  try {
    scene = load_(tile_index);
    TERRACAST_CHECK(scene->num_bytes() <= bytes_while_loading_[tile_index],
                    "a tile of {} bytes, {} foreseen", scene->num_bytes(),
                    bytes_while_loading_[tile_index]);
  } catch (...) {
    give_up_load(tile_index);
    throw;
  }
  const TileScene& result = *scene;
  {
    const std::lock_guard lock(mutex_);
    if (pin != nullptr) pin->renew();  // before anybody can evict it
    slot.is_loading = false;
    bytes_loading_ -= bytes_while_loading_[tile_index];
    slot.owned = std::move(scene);
    slot.scene.store(slot.owned.get());
    const std::uint64_t epoch = epoch_.fetch_add(1) + 1;
    slot.last_used.store(pin != nullptr ? epoch : expected_at_, std::memory_order_relaxed);
    ++stats_.num_loaded;
    stats_.bytes_resident += result.num_bytes();
    stats_.peak_bytes_resident = std::max(stats_.peak_bytes_resident, stats_.bytes_resident);
  }
  loaded_.notify_all();
  return result;
}

void SceneCache::give_up_load(std::size_t tile_index) {
  {
    const std::lock_guard lock(mutex_);
    slots_[tile_index].is_loading = false;
    bytes_loading_ -= bytes_while_loading_[tile_index];
  }
  loaded_.notify_all();
}

bool SceneCache::fits(std::size_t tile_index, std::uint64_t bytes_held) const {
  const std::uint64_t bytes = bytes_held + bytes_loading_ + bytes_while_loading_[tile_index];
  return static_cast<double>(bytes) <= budget_bytes_ || (bytes_held == 0 && bytes_loading_ == 0);
}

SceneCache::Room SceneCache::take_room(std::size_t tile_index, std::int64_t after_turn,
                                       Freed& freed) {
  for (;;) {
    free_unpinned(freed);
    if (fits(tile_index, stats_.bytes_resident)) {
      bytes_loading_ += bytes_while_loading_[tile_index];
      return Room::Taken;
    }
    if (fits(tile_index, stats_.bytes_resident - bytes_retired_)) return Room::HeldByReaders;
    if (!evict_one(after_turn)) return bytes_retired_ > 0 ? Room::HeldByReaders : Room::None;
  }
}

bool SceneCache::evict_one(std::int64_t after_turn) {
  const auto order_of = [&](const Slot& slot) {
    // What was used since the last call of expect will be needed again.
    const std::uint64_t last_used = slot.last_used.load(std::memory_order_relaxed);
    const std::uint32_t turn = last_used > expected_at_ ? 0 : slot.next_turn;
    return std::tuple(turn, ~last_used);
  };
  std::size_t latest = slots_.size();
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (!slots_[i].owned) continue;
    if (latest == slots_.size() || order_of(slots_[i]) > order_of(slots_[latest])) latest = i;
  }
  if (latest == slots_.size() || std::get<0>(order_of(slots_[latest])) <= after_turn) return false;
  Slot& slot = slots_[latest];
  slot.scene.store(nullptr);
  bytes_retired_ += slot.owned->num_bytes();
  retired_.push_back(
      {.epoch = epoch_.fetch_add(1) + 1, .tile_index = latest, .scene = std::move(slot.owned)});
  ++stats_.num_evicted;
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
    stats_.bytes_resident -= retired->scene->num_bytes();
    bytes_retired_ -= retired->scene->num_bytes();
    freed.push_back(std::move(*retired));
  }
  retired_.erase(first, retired_.end());
}

void SceneCache::expect(std::vector<Expected> tiles) {
  const std::lock_guard lock(prefetch_mutex_);
  {
    const std::lock_guard cache_lock(mutex_);
    for (Slot& slot : slots_) {
      const bool is_used = slot.last_used.load(std::memory_order_relaxed) > expected_at_;
      slot.next_turn = is_used ? 0 : kNever;
    }
    for (const Expected& tile : tiles)
      slots_[tile.tile_index].next_turn = std::min(slots_[tile.tile_index].next_turn, tile.turn);
    // Before the epoch of anything that is used from now on.
    expected_at_ = epoch_.fetch_add(1);
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
      case Room::HeldByReaders:
        std::this_thread::sleep_for(kLookAgain);
        break;
      case Room::None:  // until something else is expected
        next = std::numeric_limits<std::size_t>::max();
    }
  }
}

SceneCache::Room SceneCache::prefetch(const Expected& tile) {
  Slot& slot = slots_[tile.tile_index];
  Freed freed;
  {
    const std::lock_guard lock(mutex_);
    if (slot.owned || slot.is_loading || take_back(tile.tile_index)) return Room::Taken;
    const Room room = take_room(tile.tile_index, tile.turn, freed);
    if (room != Room::Taken) return room;
    slot.is_loading = true;
  }
  give_back(freed);
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
