#include "validate/oracle/geometry_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "world/tile_store.h"

namespace terracast::oracle {
namespace {

/// By how much nearer an eye must be before a tile counts as too coarse: poses are rounded to less.
constexpr double kSpare_m = 1e-5;
constexpr double kSpareRelative = 1e-9;

world::TileId id_of(const TileKey& key) { return {key.level, key.x, key.y}; }

/// Tiles by address, and every tile that lies above one of them.
class Leaves {
 public:
  Leaves(const ShownGeometry& geometry, int coarsest_level) : coarsest_level_(coarsest_level) {
    for (const ShownTile& tile : geometry.tiles) {
      leaves_.insert(tile.key);
      for (TileKey above = tile.key; above.level < coarsest_level;) {
        above = above.parent();
        if (!split_.insert(above).second) break;
      }
    }
  }

  const std::set<TileKey>& all() const { return leaves_; }
  bool has(const TileKey& key) const { return leaves_.contains(key); }
  bool is_split(const TileKey& key) const { return split_.contains(key); }

  /// The leaf that is a tile or lies above it.
  std::optional<TileKey> above(TileKey key) const {
    for (; key.level <= coarsest_level_; key = key.parent())
      if (has(key)) return key;
    return std::nullopt;
  }

  /// A tile below `key` (or itself) that no leaf covers and that has none within; the largest first.
  std::optional<TileKey> find_gap(const TileKey& key) const {
    if (has(key)) return std::nullopt;
    if (!is_split(key)) return key;
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      if (const auto gap = find_gap(key.child(quadrant))) return gap;
    return std::nullopt;
  }

 private:
  int coarsest_level_;
  std::set<TileKey> leaves_;
  std::set<TileKey> split_;
};

class RuleBook {
 public:
  RuleBook(const ShownGeometry& geometry, const WorldFolder& world)
      : geometry_(geometry),
        store_(world.store()),
        coarsest_level_(store_.manifest().coarsest_level),
        leaves_(geometry, coarsest_level_) {}

  RuleFaults run(std::span<const Eye> eyes) {
    check_tiles();
    check_cover();
    for (const TileKey& key : leaves_.all()) check_sides(key);
    check_spacing(eyes);
    return std::move(faults_);
  }

 private:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    if (++faults_.count == 1) faults_.first = fmt::format(format, std::forward<Args>(args)...);
  }

  void check_tiles() {
    std::set<TileKey> seen;
    for (const ShownTile& tile : geometry_.tiles) {
      if (!seen.insert(tile.key).second) add("tile {} is named twice", tile.key.name());
      const world::TileInfo* info = store_.find(id_of(tile.key));
      if (info == nullptr)
        add("tile {} is not in the world", tile.key.name());
      else if (info->content_hash != tile.content_hash)
        add("tile {} holds {}, the world's holds {}", tile.key.name(), tile.content_hash,
            info->content_hash);
      else
        continue;
      faults_.can_be_measured = false;
    }
  }

  void check_cover() {
    for (const TileKey& key : leaves_.all()) {
      if (key.level < coarsest_level_)
        if (const auto above = leaves_.above(key.parent()))
          add("tile {} lies within tile {}", key.name(), above->name());
      TileKey root = key;
      while (root.level < coarsest_level_) root = root.parent();
      if (root.level > coarsest_level_ || store_.find(id_of(root)) == nullptr)
        add("tile {} lies outside the world's coarsest tiles", key.name());
    }
    for (const world::TileInfo& info : store_.manifest().tiles) {
      const TileKey root{info.id.level, info.id.x, info.id.y};
      if (root.level != coarsest_level_) continue;
      if (const auto gap = leaves_.find_gap(root))
        add("no tile covers {}, from ({}, {}) m on", gap->name(), id_of(*gap).corner_world().x(),
            id_of(*gap).corner_world().y());
    }
  }

  void check_sides(const TileKey& key) {
    constexpr int kSides[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    for (const auto& side : kSides) {
      const auto beside = leaves_.above({key.level, key.x + side[0], key.y + side[1]});
      if (beside && beside->level > key.level + 1)
        add("tiles {} and {} share a side, but differ by {} levels", key.name(), beside->name(),
            beside->level - key.level);
    }
  }

  void check_spacing(std::span<const Eye> eyes) {
    for (const TileKey& key : leaves_.all()) {
      const world::TileInfo* info = store_.find(id_of(key));
      const double spacing_m = std::ldexp(1.0, key.level);
      if (info == nullptr || spacing_m <= geometry_.finest_spacing_m) continue;
      const Eigen::Vector3d lowest(256.0 * spacing_m * key.x, 256.0 * spacing_m * key.y,
                                   info->lowest_z_world);
      const Eigen::Vector3d highest(lowest.x() + 256.0 * spacing_m, lowest.y() + 256.0 * spacing_m,
                                    info->highest_z_world);
      for (const Eye& eye : eyes) {
        const Eigen::Vector3d outside =
            (lowest - eye.position_world).cwiseMax(eye.position_world - highest).cwiseMax(0.0);
        const double distance_m = outside.norm() * (1.0 + kSpareRelative) + kSpare_m;
        if (spacing_m * eye.pixels_per_radian <= geometry_.cell_px * distance_m) continue;
        add("tile {} spans {:.3g} px a cell from {} at {:.6g} m; {} px are allowed", key.name(),
            spacing_m * eye.pixels_per_radian / outside.norm(), eye.name, outside.norm(),
            geometry_.cell_px);
        break;
      }
    }
  }

  const ShownGeometry& geometry_;
  const world::TileStore& store_;
  int coarsest_level_;
  Leaves leaves_;
  RuleFaults faults_;
};

}  // namespace

RuleFaults find_rule_faults(const ShownGeometry& geometry, const WorldFolder& world,
                            std::span<const Eye> eyes) {
  return RuleBook(geometry, world).run(eyes);
}

}  // namespace terracast::oracle
