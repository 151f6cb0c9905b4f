#include "batch/board.h"

#include <algorithm>

namespace terracast::batch {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }
std::size_t at(Stage stage) { return static_cast<std::size_t>(stage); }

void add_once(std::vector<int>& shards, int shard) {
  if (shards.empty() || shards.back() != shard) shards.push_back(shard);
}

}  // namespace

Board::Board(const Plan& plan, const Claims& claims)
    : plan_(plan),
      claims_(claims),
      tiles_of_run_(plan.runs.size()),
      renders_of_run_(plan.runs.size()),
      exports_of_run_(plan.runs.size()) {
  for (const Stage stage : kStages) done_.emplace_back(plan.of(stage).size(), std::uint8_t{0});
  for (const Shard& shard : plan.of(Stage::Tile))
    tiles_of_run_[at(shard.pieces.front().run)] = shard.id.index;
  for (const Shard& shard : plan.of(Stage::Render))
    for (const Piece& piece : shard.pieces)
      add_once(renders_of_run_[at(piece.run)], shard.id.index);
  for (std::size_t run = 0; run < plan.runs.size(); ++run)
    exports_of_run_[run].resize(plan.runs[run].formats.size());
  for (const Shard& shard : plan.of(Stage::Export))
    for (const Piece& piece : shard.pieces)
      exports_of_run_[at(piece.run)][at(piece.format)] = shard.id.index;
}

void Board::refresh() {
  for (const Stage stage : kStages)
    if (!is_complete(stage))
      for (const int index : claims_.done(stage))
        if (index >= 0 && at(index) < done_[at(stage)].size()) done_[at(stage)][at(index)] = 1;
}

bool Board::find_reopened() {
  bool is_any = false;
  for (const Stage stage : kStages) {
    std::vector<std::uint8_t>& done = done_[at(stage)];
    std::vector<std::uint8_t> is_listed(done.size());
    for (const int index : claims_.done(stage))
      if (index >= 0 && at(index) < done.size()) is_listed[at(index)] = 1;
    for (std::size_t i = 0; i < done.size(); ++i) {
      // A listing may be old, of a file that was made just now.
      if (done[i] == 0 || is_listed[i] != 0 || claims_.is_done({stage, static_cast<int>(i)}))
        continue;
      done[i] = 0;
      is_any = true;
    }
  }
  return is_any;
}

void Board::set_done(const ShardId& shard) { done_[at(shard.stage)][at(shard.index)] = 1; }

bool Board::is_done(const ShardId& shard) const {
  return done_[at(shard.stage)][at(shard.index)] != 0;
}

int Board::num_done(Stage stage) const {
  const auto& done = done_[at(stage)];
  return static_cast<int>(std::count(done.begin(), done.end(), std::uint8_t{1}));
}

bool Board::is_complete(Stage stage) const {
  const auto& done = done_[at(stage)];
  return std::find(done.begin(), done.end(), std::uint8_t{0}) == done.end();
}

template <class Need>
void Board::for_each_need(const ShardId& id, const Need& need) const {
  const Shard& shard = plan_.of(id.stage)[at(id.index)];
  switch (id.stage) {
    case Stage::Tile:
      return;
    case Stage::Render:
      need({Stage::Tile, tiles_of_run_[at(shard.pieces.front().run)]});
      return;
    case Stage::Export:
      for (const Piece& piece : shard.pieces)
        for (const int frames : renders_of_run_[at(piece.run)])
          if (!need({Stage::Render, frames})) return;
      return;
    case Stage::Validate:
      for (const Piece& piece : shard.pieces)
        if (!need({Stage::Export, exports_of_run_[at(piece.run)][at(piece.format)]})) return;
      return;
    case Stage::Merge:
      for (const Stage stage : {Stage::Export, Stage::Validate})
        for (const Shard& earlier : plan_.of(stage))
          if (!need(earlier.id)) return;
      return;
  }
}

bool Board::is_ready(const ShardId& shard) const {
  bool is_ready = true;
  for_each_need(shard, [&](const ShardId& needed) { return is_ready = is_done(needed); });
  return is_ready;
}

std::vector<ShardId> Board::missing(const ShardId& shard) const {
  std::vector<ShardId> missing;
  for_each_need(shard, [&](const ShardId& needed) {
    if (!is_done(needed)) missing.push_back(needed);
    return true;
  });
  return missing;
}

}  // namespace terracast::batch
