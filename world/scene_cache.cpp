#include "world/scene_cache.h"

#include <algorithm>
#include <exception>

#include "core/error.h"

namespace terracast::world {

// How a scene is freed while others look at the cache without a lock. A reader writes the current
// epoch into its place, then reads scene pointers. An evictor clears the pointer, then counts the
// epoch up, then looks at the readers' places (all in one total order). A reader whose place holds
// at least the new epoch has read it after the pointer was cleared; a place that was idle when the
// evictor looked is written, and pointers read, only later. So the scene is unreachable once no
// place holds a smaller epoch.

SceneCache::SceneCache(std::size_t num_tiles, double budget_bytes, Load load)
    : budget_bytes_(budget_bytes), load_(std::move(load)), slots_(num_tiles) {}

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

const TileScene& SceneCache::get(const Pin& pin, std::size_t tile_index) {
  Slot& slot = slots_[tile_index];
  const std::uint64_t epoch = pin.reader_->load(std::memory_order_relaxed);
  if (slot.last_used.load(std::memory_order_relaxed) < epoch)
    slot.last_used.store(epoch, std::memory_order_relaxed);
  const TileScene* scene = slot.scene.load();
  return scene != nullptr ? *scene : load(tile_index, true);
}

const TileScene& SceneCache::load(std::size_t tile_index, bool for_ray) {
  Slot& slot = slots_[tile_index];
  {
    std::unique_lock lock(mutex_);
    if (for_ray) ++stats_.num_waited;
    loaded_.wait(lock, [&] { return !slot.is_loading; });
    if (slot.owned || take_back(tile_index)) return *slot.owned;
    slot.is_loading = true;
  }
  std::unique_ptr<const TileScene> scene;
  try {
    scene = load_(tile_index);
  } catch (...) {
    {
      const std::lock_guard lock(mutex_);
      slot.is_loading = false;
    }
    loaded_.notify_all();
    throw;
  }
  const TileScene& result = *scene;
  std::vector<Retired> to_free;
  {
    const std::lock_guard lock(mutex_);
    slot.is_loading = false;
    slot.owned = std::move(scene);
    slot.scene.store(slot.owned.get());
    slot.last_used.store(epoch_.fetch_add(1) + 1, std::memory_order_relaxed);
    typical_bytes_ = result.num_bytes();
    ++stats_.num_loaded;
    stats_.bytes_resident += result.num_bytes();
    evict_down_to_budget(tile_index);
    to_free = take_unpinned();
    stats_.peak_bytes_resident = std::max(stats_.peak_bytes_resident, stats_.bytes_resident);
  }
  loaded_.notify_all();
  return result;  // to_free is freed here, outside the lock
}

void SceneCache::evict_down_to_budget(std::size_t keep) {
  std::uint64_t bytes_kept = 0;
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (!slots_[i].owned) continue;
    bytes_kept += slots_[i].owned->num_bytes();
    if (i != keep) candidates.push_back(i);
  }
  if (static_cast<double>(bytes_kept) <= budget_bytes_) return;
  std::sort(candidates.begin(), candidates.end(), [&](std::size_t a, std::size_t b) {
    return slots_[a].last_used.load(std::memory_order_relaxed) <
           slots_[b].last_used.load(std::memory_order_relaxed);
  });
  for (const std::size_t i : candidates) {
    if (static_cast<double>(bytes_kept) <= budget_bytes_) break;
    Slot& slot = slots_[i];
    bytes_kept -= slot.owned->num_bytes();
    slot.scene.store(nullptr);
    retired_.push_back(
        {.epoch = epoch_.fetch_add(1) + 1, .tile_index = i, .scene = std::move(slot.owned)});
    ++stats_.num_evicted;
  }
}

bool SceneCache::take_back(std::size_t tile_index) {
  const auto found = std::find_if(retired_.begin(), retired_.end(), [&](const Retired& retired) {
    return retired.tile_index == tile_index;
  });
  if (found == retired_.end()) return false;
  Slot& slot = slots_[tile_index];
  slot.owned = std::move(found->scene);
  retired_.erase(found);
  slot.scene.store(slot.owned.get());
  slot.last_used.store(epoch_.fetch_add(1) + 1, std::memory_order_relaxed);
  evict_down_to_budget(tile_index);
  return true;
}

std::vector<SceneCache::Retired> SceneCache::take_unpinned() {
  std::uint64_t oldest = epoch_.load();
  for (const Reader& reader : readers_) {
    const std::uint64_t epoch = reader.epoch.load();
    if (epoch != kIdle) oldest = std::min(oldest, epoch);
  }
  const auto first = std::partition(retired_.begin(), retired_.end(),
                                    [&](const Retired& retired) { return retired.epoch > oldest; });
  std::vector<Retired> unpinned(std::make_move_iterator(first),
                                std::make_move_iterator(retired_.end()));
  retired_.erase(first, retired_.end());
  for (const Retired& retired : unpinned) stats_.bytes_resident -= retired.scene->num_bytes();
  return unpinned;
}

void SceneCache::prefetch(std::vector<std::uint32_t> tile_indices) {
  std::erase_if(tile_indices, [&](std::uint32_t i) { return slots_[i].scene.load() != nullptr; });
  const std::lock_guard lock(prefetch_mutex_);
  if (tile_indices.empty()) {
    to_prefetch_.clear();
    return;
  }
  to_prefetch_ = std::move(tile_indices);
  has_prefetch_ = true;
  if (!prefetcher_.joinable())
    prefetcher_ = std::jthread([this](const std::stop_token& stop) { prefetch_loop(stop); });
  prefetch_asked_.notify_one();
}

void SceneCache::prefetch_loop(const std::stop_token& stop) {
  std::size_t next = 0;
  for (;;) {
    std::uint32_t tile_index = 0;
    {
      std::unique_lock lock(prefetch_mutex_);
      const auto has_work = [&] { return has_prefetch_ || next < to_prefetch_.size(); };
      if (!prefetch_asked_.wait(lock, stop, has_work)) return;
      if (has_prefetch_) next = 0;
      has_prefetch_ = false;
      if (next >= to_prefetch_.size()) continue;
      tile_index = to_prefetch_[next++];
      const std::lock_guard cache_lock(mutex_);
      if (static_cast<double>(stats_.bytes_resident + typical_bytes_) > budget_bytes_) {
        next = to_prefetch_.size();
        continue;
      }
      if (slots_[tile_index].owned || slots_[tile_index].is_loading) continue;
    }
    if (stop.stop_requested()) return;
    try {
      load(tile_index, false);
    } catch (const std::exception&) {  // the ray that needs it will say what is wrong
    }
  }
}

SceneCache::Stats SceneCache::stats() const {
  const std::lock_guard lock(mutex_);
  return stats_;
}

}  // namespace terracast::world
