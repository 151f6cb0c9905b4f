#include "render/reuse.h"

#include <algorithm>
#include <limits>
#include <unordered_map>

namespace terracast::render {
namespace {

using world::TileId;

TileId id_of(const capture::ShownTile& tile) { return {tile.level, tile.x, tile.y}; }

using CutIndex = std::unordered_map<TileId, int>;

/// The tile of a cut that holds a tile, itself left out; -1: none does.
int holder_of(TileId id, const CutIndex& cut) {
  constexpr int kMostLevels = 40;  // more than a world has
  for (int i = 0; i < kMostLevels; ++i) {
    id = id.parent();
    const auto found = cut.find(id);
    if (found != cut.end()) return found->second;
  }
  return -1;
}

}  // namespace

std::optional<EarlierFrames> EarlierFrames::open(const std::filesystem::path& folder,
                                                 const RenderInputs& inputs) {
  std::optional<capture::WholeFrames> earlier = capture::WholeFrames::open(folder);
  if (!earlier || earlier->info().cameras != inputs.plan.cameras) return std::nullopt;
  EarlierFrames frames(std::move(*earlier), inputs);
  if (!frames.find_raised()) return std::nullopt;
  return frames;
}

bool EarlierFrames::find_raised() {
  const std::vector<capture::ShownTile>& tiles = earlier_.info().geometry.tiles;
  const auto height_of = [&](int earlier) {
    return tiles[static_cast<std::size_t>(earlier)].highest_z_world_m;
  };
  CutIndex earlier_of;
  CutIndex now_of;
  for (std::size_t i = 0; i < tiles.size(); ++i)
    earlier_of.emplace(id_of(tiles[i]), static_cast<int>(i));
  for (std::size_t i = 0; i < inputs_.cut.size(); ++i)
    now_of.emplace(inputs_.cut[i].id, static_cast<int>(i));

  std::unordered_map<int, Raised> in_place_of_others;
  for (const capture::ShownTile& tile : tiles) {
    const int earlier = earlier_of.at(id_of(tile));
    const auto now = now_of.find(id_of(tile));
    now_of_earlier_.push_back(now == now_of.end() ? -1 : now->second);
    if (now == now_of.end()) {
      const int holder = holder_of(id_of(tile), now_of);
      if (holder < 0) continue;
      in_place_of_others[holder].earlier.push_back(earlier);
    } else if (inputs_.store.find(now->first)->content_hash != tile.content_hash &&
               inputs_.tiles[static_cast<std::size_t>(now->second)].highest_z_world >
                   tile.highest_z_world_m) {
      raised_.push_back({.tile = now->second,
                         .earlier = {earlier},
                         .highest_z_world_m = tile.highest_z_world_m,
                         .is_same_tile = true});
    }
  }
  for (const auto& [id, tile] : now_of) {
    if (earlier_of.contains(id)) continue;
    Raised& raised = in_place_of_others[tile];
    raised.tile = tile;
    if (const int holder = holder_of(id, earlier_of); holder >= 0) raised.earlier.push_back(holder);
    if (raised.earlier.empty()) return false;
    raised.highest_z_world_m = std::numeric_limits<double>::infinity();
    for (const int earlier : raised.earlier)
      raised.highest_z_world_m = std::min(raised.highest_z_world_m, height_of(earlier));
    raised_.push_back(raised);
  }
  return true;
}

std::optional<capture::FrameRecord> EarlierFrames::find(int frame) const {
  if (frame >= earlier_.info().num_frames) return std::nullopt;
  std::optional<capture::FrameRecord> record = earlier_.record(frame);
  if (!record) return std::nullopt;
  const std::vector<int>& touched = record->touched_tiles;
  if (!touched.empty() && static_cast<std::size_t>(touched.back()) >= inputs_.cut.size())
    return std::nullopt;
  if (inputs_.keys.key(frame, touched) != record->key) return std::nullopt;
  if (!still_sees_the_same(*record) || !earlier_.has_files(*record)) return std::nullopt;
  return record;
}

bool EarlierFrames::still_sees_the_same(capture::FrameRecord& record) const {
  constexpr double kNotPassed = std::numeric_limits<double>::infinity();
  std::vector<double> passed_above_z(now_of_earlier_.size(), kNotPassed);
  for (const capture::PassedTile& passed : record.passed_tiles)
    passed_above_z[static_cast<std::size_t>(passed.tile)] = passed.above_z_world_m;

  const double told_below = told_below_z(record.touched_tiles, inputs_.tiles);
  const auto may_come_into_view = [&](const Raised& raised) {
    const double top_z = inputs_.tiles[static_cast<std::size_t>(raised.tile)].highest_z_world;
    for (const int earlier : raised.earlier) {
      const double passed_z = passed_above_z[static_cast<std::size_t>(earlier)];
      if (passed_z == kNotPassed) continue;
      // What a frame tells of a tile that is gone cannot be told of those in its place.
      if (!raised.is_same_tile) return true;
      return top_z >= passed_z;
    }
    const double from_z = std::max(told_below, raised.highest_z_world_m);
    if (top_z <= from_z) return false;
    const TileId& id = inputs_.cut[static_cast<std::size_t>(raised.tile)].id;
    const Eigen::Vector2d corner = id.corner_world();
    return inputs_.sight.may_reach(
        record.index, record.touched_tiles,
        {Eigen::Vector3d(corner.x(), corner.y(), from_z),
         Eigen::Vector3d(corner.x() + id.side_m(), corner.y() + id.side_m(), top_z)});
  };
  if (std::any_of(raised_.begin(), raised_.end(), may_come_into_view)) return false;

  for (capture::PassedTile& passed : record.passed_tiles) {
    passed.tile = now_of_earlier_[static_cast<std::size_t>(passed.tile)];
    if (passed.tile < 0) return false;
  }
  return true;
}

}  // namespace terracast::render
