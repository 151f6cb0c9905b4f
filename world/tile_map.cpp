#include "world/tile_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "core/error.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Falling rays start this far above the highest point of all.
constexpr double kAboveAll_m = 1.0;

/// On which side of a line a ray is at t, decided as crossings are: by the t of the line.
bool is_beyond(double line, double origin, double direction, double inverse, double t) {
  if (direction == 0.0) return origin >= line;
  const double t_line = (line - origin) * inverse;
  return direction > 0.0 ? t >= t_line : t < t_line;
}

std::int32_t leaf_code(std::uint32_t leaf) { return -2 - static_cast<std::int32_t>(leaf); }

}  // namespace

TileMap::TileMap(const TileStore& store, const std::vector<CutTile>& cut) {
  if (cut.empty()) fail(ErrorKind::Input, "{}: no tiles to cast rays at", store.folder().string());
  highest_z_world_ = -kInfinity;
  std::unordered_set<TileId> seen;
  for (const CutTile& tile : cut) {
    const TileInfo* info = store.find(tile.id);
    if (info == nullptr)
      fail(ErrorKind::Input, "{}: the world has no tile {}; tile it again", store.folder().string(),
           tile.id.name());
    if (!seen.insert(tile.id).second)
      fail(ErrorKind::Input, "{}: the cut names tile {} twice", store.folder().string(),
           tile.id.name());
    const geo::Box3d box = info->box_world();
    leaves_.push_back({.x = {box.min().x(), box.max().x()},
                       .y = {box.min().y(), box.max().y()},
                       .highest_z_world = box.max().z(),
                       .beyond = {}});
    highest_z_world_ = std::max(highest_z_world_, box.max().z());
    root_level_ = leaves_.size() == 1 ? tile.id.level : std::max(root_level_, tile.id.level);
  }
  std::unordered_set<TileId> root_ids;
  for (const CutTile& tile : cut) {
    TileId root = tile.id;
    while (root.level < root_level_) root = root.parent();
    root_ids.insert(root);
  }
  const auto by_x = [](const TileId& a, const TileId& b) { return a.x < b.x; };
  const auto by_y = [](const TileId& a, const TileId& b) { return a.y < b.y; };
  const auto [west, east] = std::minmax_element(root_ids.begin(), root_ids.end(), by_x);
  const auto [south, north] = std::minmax_element(root_ids.begin(), root_ids.end(), by_y);
  root_side_m_ = west->side_m();
  root_x0_ = west->x;
  root_y0_ = south->y;
  num_roots_x_ = east->x - west->x + 1;
  num_roots_y_ = north->y - south->y + 1;
  const std::int64_t num_cells = static_cast<std::int64_t>(num_roots_x_) * num_roots_y_;
  if (num_cells > (1 << 24))
    fail(ErrorKind::Input, "{}: the cut's coarsest tiles lie too far apart",
         store.folder().string());
  is_rectangle_ = num_cells == static_cast<std::int64_t>(root_ids.size());
  root_grid_.assign(static_cast<std::size_t>(num_cells), -1);
  for (std::uint32_t leaf = 0; leaf < cut.size(); ++leaf) add_leaf(leaf, cut[leaf].id);
  find_neighbours(cut);
}

void TileMap::add_leaf(std::uint32_t leaf, const TileId& id) {
  TileId root = id;
  while (root.level < root_level_) root = root.parent();
  std::int32_t* place = &root_grid_[static_cast<std::size_t>((root.y - root_y0_) * num_roots_x_ +
                                                             (root.x - root_x0_))];
  const bool is_new_root = *place == -1;
  std::int32_t at = -1;  // node that holds the child in question, -1: the root itself
  std::size_t child = 0;
  for (int level = root_level_; level > id.level; --level) {
    TileId ancestor = id;
    while (ancestor.level < level) ancestor = ancestor.parent();
    std::int32_t& code = at < 0 ? *place : nodes_[static_cast<std::size_t>(at)].children[child];
    if (code == -1) {
      code = static_cast<std::int32_t>(nodes_.size());
      const Eigen::Vector2d center = ancestor.center_world();
      const std::int32_t made = code;
      nodes_.push_back({center.x(), center.y(), {-1, -1, -1, -1}});  // invalidates `code`
      at = made;
    } else {
      TERRACAST_CHECK(code >= 0, "tile {} lies within another tile of the cut", id.name());
      at = code;
    }
    TileId below = id;
    while (below.level < level - 1) below = below.parent();
    child = static_cast<std::size_t>((below.x & 1) + 2 * (below.y & 1));
  }
  std::int32_t& code = at < 0 ? *place : nodes_[static_cast<std::size_t>(at)].children[child];
  TERRACAST_CHECK(code == -1, "tile {} holds other tiles of the cut", id.name());
  code = leaf_code(leaf);
  if (is_new_root) {
    const Eigen::Vector2d corner = root.corner_world();
    roots_.push_back(
        {corner.x(), corner.x() + root_side_m_, corner.y(), corner.y() + root_side_m_, *place});
  }
}

void TileMap::find_neighbours(const std::vector<CutTile>& cut) {
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    Leaf& leaf = leaves_[i];
    for (std::size_t side = 0; side < 4; ++side) {
      for (std::size_t half = 0; half < 2; ++half) {
        const double side_m = leaf.x[1] - leaf.x[0];
        const double along = (half == 0 ? 0.25 : 0.75) * side_m;
        const double outside = side_m / 1024.0;
        const double x = side == 0   ? leaf.x[0] - outside
                         : side == 1 ? leaf.x[1]
                                     : leaf.x[0] + along;
        const double y = side == 2   ? leaf.y[0] - outside
                         : side == 3 ? leaf.y[1]
                                     : leaf.y[0] + along;
        const std::uint32_t beyond = leaf_at(x, y);
        if (beyond != kNone && std::abs(cut[beyond].id.level - cut[i].id.level) > 1)
          fail(ErrorKind::Input, "the cut is not balanced: tile {} lies beside {}",
               cut[i].id.name(), cut[beyond].id.name());
        leaf.beyond[side][half] = beyond;
      }
    }
  }
}

std::int32_t TileMap::root_at(double x_world, double y_world) const {
  const double x = std::floor(x_world / root_side_m_) - root_x0_;
  const double y = std::floor(y_world / root_side_m_) - root_y0_;
  if (!(x >= 0.0 && y >= 0.0 && x < num_roots_x_ && y < num_roots_y_)) return -1;
  return root_grid_[static_cast<std::size_t>(y) * static_cast<std::size_t>(num_roots_x_) +
                    static_cast<std::size_t>(x)];
}

std::uint32_t TileMap::leaf_at(double x_world, double y_world) const {
  std::int32_t code = root_at(x_world, y_world);
  while (code >= 0) {
    const Node& node = nodes_[static_cast<std::size_t>(code)];
    code = node.children[static_cast<std::size_t>((x_world >= node.x_middle ? 1 : 0) +
                                                  (y_world >= node.y_middle ? 2 : 0))];
  }
  return code == -1 ? kNone : static_cast<std::uint32_t>(-2 - code);
}

std::uint32_t TileMap::leaf_on_ray(std::int32_t code, const WalkRay& ray, double t) const {
  const Eigen::Vector3d& o = ray.origin_world;
  const Eigen::Vector3d& d = ray.direction_world;
  while (code >= 0) {
    const Node& node = nodes_[static_cast<std::size_t>(code)];
    const bool is_east = is_beyond(node.x_middle, o.x(), d.x(), ray.inverse_x, t);
    const bool is_north = is_beyond(node.y_middle, o.y(), d.y(), ray.inverse_y, t);
    code = node.children[static_cast<std::size_t>((is_east ? 1 : 0) + (is_north ? 2 : 0))];
  }
  return code == -1 ? kNone : static_cast<std::uint32_t>(-2 - code);
}

bool TileMap::enter_root(const WalkRay& ray, double t, double t_max, TilePassage& passage) const {
  const Eigen::Vector3d& o = ray.origin_world;
  const Eigen::Vector3d& d = ray.direction_world;
  double nearest_t = kInfinity;
  const Root* nearest = nullptr;
  int nearest_side = -1;
  for (const Root& root : roots_) {
    double t_in = -kInfinity;
    double t_end = kInfinity;
    int side = -1;
    const auto clip = [&](double low, double high, double origin, double direction, double inverse,
                          int low_side) {
      if (direction == 0.0) return origin >= low && origin <= high;
      const double t_low = (low - origin) * inverse;
      const double t_high = (high - origin) * inverse;
      if (std::min(t_low, t_high) > t_in) {
        t_in = std::min(t_low, t_high);
        side = direction > 0.0 ? low_side : low_side + 1;
      }
      t_end = std::min(t_end, std::max(t_low, t_high));
      return true;
    };
    if (!clip(root.x0, root.x1, o.x(), d.x(), ray.inverse_x, 0)) continue;
    if (!clip(root.y0, root.y1, o.y(), d.y(), ray.inverse_y, 2)) continue;
    // One that is left at t has been passed already.
    if (t_in < t || t_in > t_end || t_end <= t || t_in > t_max || t_in >= nearest_t) continue;
    nearest_t = t_in;
    nearest = &root;
    nearest_side = side;
  }
  if (nearest == nullptr) return false;
  passage.tile = leaf_on_ray(nearest->node, ray, nearest_t);
  passage.side = nearest_side;
  passage.t_entry = nearest_t;
  return passage.tile != kNone;
}

bool TileMap::first_passage(const WalkRay& ray, double t_min, double t_max, std::uint32_t& hint,
                            TilePassage& passage) const {
  const Eigen::Vector3d& o = ray.origin_world;
  const Eigen::Vector3d& d = ray.direction_world;
  double t_start = t_min;
  if (d.z() < 0.0)
    t_start = std::max(t_start, (highest_z_world_ + kAboveAll_m - o.z()) * ray.inverse_z);
  else if (o.z() + t_start * d.z() > highest_z_world_ + kAboveAll_m)
    return false;
  if (t_start > t_max) return false;
  const double x = o.x() + t_start * d.x();
  const double y = o.y() + t_start * d.y();
  const Leaf& hinted = leaves_[hint];
  if (x > hinted.x[0] && x < hinted.x[1] && y > hinted.y[0] && y < hinted.y[1]) {
    passage.tile = hint;
  } else {
    const std::optional<std::uint32_t> tile = tile_at_place(x, y);
    if (!tile) return enter_root(ray, t_start, t_max, passage) && go_to_ground(ray, t_max, passage);
    passage.tile = *tile;
    hint = *tile;
  }
  passage.side = -1;
  passage.t_entry = t_start;
  return go_to_ground(ray, t_max, passage);
}

bool TileMap::next_passage(const WalkRay& ray, double t_max, TilePassage& passage) const {
  return step(ray, t_max, passage) && go_to_ground(ray, t_max, passage);
}

bool TileMap::go_to_ground(const WalkRay& ray, double t_max, TilePassage& passage) const {
  const Eigen::Vector3d& o = ray.origin_world;
  const Eigen::Vector3d& d = ray.direction_world;
  for (;;) {
    const Leaf& leaf = leaves_[passage.tile];
    passage.t_exit_x =
        (leaf.x[static_cast<std::size_t>(ray.to_east)] - o.x()) * ray.inverse_x + ray.never_x;
    passage.t_exit_y =
        (leaf.y[static_cast<std::size_t>(ray.to_north)] - o.y()) * ray.inverse_y + ray.never_y;
    passage.t_exit =
        std::max(std::min(std::min(passage.t_exit_x, passage.t_exit_y), t_max), passage.t_entry);
    bool meets = false;
    if (d.z() == 0.0) {
      passage.t_top = kInfinity;
      meets = o.z() <= leaf.highest_z_world;
    } else {
      passage.t_top = (leaf.highest_z_world - o.z()) * ray.inverse_z;
      meets = d.z() < 0.0 ? passage.t_top <= passage.t_exit : passage.t_top >= passage.t_entry;
    }
    if (meets) return true;
    if (!step(ray, t_max, passage)) return false;
  }
}

bool TileMap::step(const WalkRay& ray, double t_max, TilePassage& passage) const {
  const double t_x = passage.t_exit_x;
  const double t_y = passage.t_exit_y;
  const Eigen::Vector3d& o = ray.origin_world;
  const Eigen::Vector3d& d = ray.direction_world;
  const double t = std::min(t_x, t_y);
  if (!(t < t_max)) return false;
  if (d.z() >= 0.0 && o.z() + passage.t_entry * d.z() > highest_z_world_ + kAboveAll_m)
    return false;
  const Leaf& leaf = leaves_[passage.tile];
  std::size_t side = 0;
  bool upper_half = false;
  if (t_x <= t_y) {
    side = d.x() > 0.0 ? 1 : 0;
    upper_half = is_beyond((leaf.y[0] + leaf.y[1]) / 2.0, o.y(), d.y(), ray.inverse_y, t);
  } else {
    side = d.y() > 0.0 ? 3 : 2;
    upper_half = is_beyond((leaf.x[0] + leaf.x[1]) / 2.0, o.x(), d.x(), ray.inverse_x, t);
  }
  const std::uint32_t next = leaf.beyond[side][upper_half ? 1 : 0];
  if (next == kNone) return !is_rectangle_ && enter_root(ray, t, t_max, passage);
  passage.tile = next;
  passage.side = static_cast<int>(side ^ 1U);
  passage.t_entry = std::max(t, passage.t_entry);
  return true;
}

std::optional<std::uint32_t> TileMap::tile_at_place(double x_world, double y_world) const {
  // Of a place on the eastern or northern border of all, the tile west or south of it.
  constexpr double kBeside_m = 0x1.0p-20;
  for (const double x : {x_world, x_world - kBeside_m}) {
    for (const double y : {y_world, y_world - kBeside_m}) {
      const std::uint32_t leaf = leaf_at(x, y);
      if (leaf != kNone && x_world <= leaves_[leaf].x[1] && y_world <= leaves_[leaf].y[1])
        return leaf;
    }
  }
  return std::nullopt;
}

}  // namespace terracast::world
