#include "world/unit_turns.h"

#include <algorithm>

#include "core/error.h"

namespace terracast::world {

void UnitTurns::set_num_processors(int num_processors) {
  num_processors_ = num_processors;
  dispatch();
}

void UnitTurns::start(Unit& unit) {
  unit.order = Unit::Order::Wait;
  unit.next = Unit::Order::Run;
  ready_.push_back(&unit);
  dispatch();
}

void UnitTurns::finish() {
  --num_running_;
  dispatch();
}

void UnitTurns::wait(Unit& unit, std::span<const TileDemand> demands) {
  unit.order = Unit::Order::Wait;
  unit.demands.assign(demands.begin(), demands.end());
  for (const TileDemand& demand : demands) awaited_[demand.tile_index].num_rays += demand.num_rays;
  waiting_.push_back(&unit);
  --num_running_;
  dispatch();
}

void UnitTurns::begin_load(std::size_t tile_index) { awaited_[tile_index].is_loading = true; }

void UnitTurns::give_up_load(std::size_t tile_index) {
  if (const auto found = awaited_.find(tile_index); found != awaited_.end()) {
    found->second.is_loading = false;
    if (found->second.num_rays == 0) awaited_.erase(found);
  }
  dispatch();
}

void UnitTurns::arrive(std::size_t tile_index) {
  for (std::size_t i = 0; i < waiting_.size();) {
    Unit& unit = *waiting_[i];
    const bool is_for_it =
        std::any_of(unit.demands.begin(), unit.demands.end(),
                    [&](const TileDemand& demand) { return demand.tile_index == tile_index; });
    if (!is_for_it) {
      ++i;
      continue;
    }
    withdraw(unit);
    unit.next = Unit::Order::Use;
    unit.tile_index = tile_index;
    ++promises_[tile_index];
    ready_.push_back(&unit);
    waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  give_up_load(tile_index);
}

void UnitTurns::keep_promise(std::size_t tile_index) {
  const auto found = promises_.find(tile_index);
  TERRACAST_CHECK(found != promises_.end(), "tile {} was not promised", tile_index);
  if (--found->second == 0) promises_.erase(found);
}

void UnitTurns::withdraw(Unit& unit) {
  for (const TileDemand& demand : unit.demands) {
    const auto found = awaited_.find(demand.tile_index);
    found->second.num_rays -= demand.num_rays;
    if (found->second.num_rays == 0 && !found->second.is_loading) awaited_.erase(found);
  }
  unit.demands.clear();
}

void UnitTurns::dispatch() {
  while (num_running_ < num_processors_) {
    if (!ready_.empty()) {
      Unit& unit = *ready_.front();
      ready_.pop_front();
      ++num_running_;
      unit.order = unit.next;
      unit.ordered.notify_one();
      continue;
    }
    auto most = awaited_.end();
    for (auto tile = awaited_.begin(); tile != awaited_.end(); ++tile)
      if (!tile->second.is_loading && tile->second.num_rays > 0 &&
          (most == awaited_.end() || tile->second.num_rays > most->second.num_rays))
        most = tile;
    if (most == awaited_.end()) return;
    const std::size_t tile_index = most->first;
    const auto loader = std::find_if(waiting_.begin(), waiting_.end(), [&](const Unit* unit) {
      return std::any_of(unit->demands.begin(), unit->demands.end(),
                         [&](const TileDemand& demand) { return demand.tile_index == tile_index; });
    });
    Unit& unit = **loader;
    waiting_.erase(loader);
    most->second.is_loading = true;
    withdraw(unit);
    ++num_running_;
    unit.tile_index = tile_index;
    unit.order = Unit::Order::Load;
    unit.ordered.notify_one();
  }
}

}  // namespace terracast::world
