#include "validate/world_check/shown_together.h"

#include <algorithm>
#include <map>

#include "validate/world_check/coincident_solids.h"

namespace terracast::world_check {
namespace {

using world::TileId;

/// Levels by which tiles of a neighbourhood differ at most.
constexpr int kLevelsApart = 2;

TileId ancestor(TileId id, int level) {
  while (id.level < level) id = id.parent();
  return id;
}

/// Whether tiles, of which one is not finer, have more than a corner in common.
bool share_edge(const TileId& coarse, const TileId& fine) {
  const int shift = coarse.level - fine.level;
  const auto lies_along = [&](int from, int at) {
    return at >= from * (1 << shift) && at < (from + 1) * (1 << shift);
  };
  const auto touches = [&](int from, int at) {
    return at + 1 == from * (1 << shift) || at == (from + 1) * (1 << shift);
  };
  return (lies_along(coarse.x, fine.x) && touches(coarse.y, fine.y)) ||
         (lies_along(coarse.y, fine.y) && touches(coarse.x, fine.x));
}

/// A shape, and all tiles beside the one that is looked at by which a cut may show it.
struct Showing {
  std::uint32_t instance_id = 0;
  const world::Solid* solid = nullptr;
  const world::ShapeLevel* shape = nullptr;
  std::vector<TileId> by;
};

std::vector<TileId> tiles_showing(const world::Solid& solid, const TileId& beside,
                                  const std::function<bool(const TileId&)>& has_tile) {
  const auto holding = [&](int level) {
    return world::tile_at(level, solid.place_m.x(), solid.place_m.y());
  };
  if (holding(beside.level) == beside) return {beside};
  std::vector<TileId> tiles;
  for (int level = beside.level - kLevelsApart; level <= beside.level + kLevelsApart; ++level)
    if (const TileId id = holding(level); has_tile(id) && may_be_in_one_cut(id, beside))
      tiles.push_back(id);
  return tiles;
}

std::vector<Showing> showings_of(const world::Tile& tile,
                                 const std::function<bool(const TileId&)>& has_tile) {
  std::vector<Showing> showings;
  for (const world::Solid& solid : tile.objects.solids) {
    std::map<int, Showing> of_shapes;  // by their coarsest level
    for (const TileId& id : tiles_showing(solid, tile.id, has_tile)) {
      const auto shape = std::find_if(
          solid.levels.begin(), solid.levels.end(),
          [&](const world::ShapeLevel& one) { return id.level <= one.coarsest_level; });
      if (shape == solid.levels.end()) continue;
      Showing& showing = of_shapes[shape->coarsest_level];
      showing.instance_id = solid.provenance.instance_id;
      showing.solid = &solid;
      showing.shape = &*shape;
      showing.by.push_back(id);
    }
    for (auto& [level, showing] : of_shapes) showings.push_back(std::move(showing));
  }
  std::sort(showings.begin(), showings.end(), [](const Showing& a, const Showing& b) {
    return std::pair(a.instance_id, a.shape->coarsest_level) <
           std::pair(b.instance_id, b.shape->coarsest_level);
  });
  return showings;
}

}  // namespace

bool may_be_in_one_cut(const TileId& one, const TileId& other) {
  const TileId& coarse = one.level >= other.level ? one : other;
  const TileId& fine = one.level >= other.level ? other : one;
  if (coarse.level - fine.level > kLevelsApart) return false;
  if (coarse == fine) return true;
  if (ancestor(fine, coarse.level) == coarse) return false;
  // With the finer one come its siblings: all of their parent's square is as fine.
  return coarse.level - fine.level < kLevelsApart ||
         !share_edge(coarse, ancestor(fine, coarse.level - 1));
}

ShownTogether coincident_shapes(const world::Tile& tile,
                                const std::function<bool(const TileId&)>& has_tile) {
  const std::vector<Showing> showings = showings_of(tile, has_tile);
  std::vector<ShownSolid> shown;
  for (const Showing& showing : showings)
    shown.push_back({showing.instance_id, showing.solid->origin_steps, &showing.shape->shape});
  const auto are_shown = [&](std::size_t first, std::size_t second) {
    for (const TileId& one : showings[first].by)
      for (const TileId& other : showings[second].by)
        if (may_be_in_one_cut(one, other)) return true;
    return false;
  };
  ShownTogether together{.num_shapes = static_cast<std::int64_t>(shown.size()), .coincident = {}};
  for (const Coincident& pair : find_coincident(shown, are_shown))
    together.coincident.push_back({.first_id = shown[pair.first].instance_id,
                                   .second_id = shown[pair.second].instance_id,
                                   .first_level = showings[pair.first].shape->coarsest_level,
                                   .second_level = showings[pair.second].shape->coarsest_level,
                                   .area_m2 = pair.area_m2,
                                   .place_world = pair.place_steps * world::kHeightStep_m});
  return together;
}

}  // namespace terracast::world_check
