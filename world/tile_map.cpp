#include "world/tile_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "core/error.h"
#include "core/packet_code.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;
using core::larger;
using core::smaller;
using core::truth;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Falling rays start this far above the highest point of all, rising ones leave there, where nobody
/// wants to know over which tiles they pass.
constexpr double kAboveAll_m = 1.0;
static_assert(RayTrail::kFollowed_m > kAboveAll_m);

/// A ray that comes into its first tile so soon after its start may have started on the surface
/// beside it.
constexpr double kStartsAtSide_m = 0x1.0p-20;

/// On which side of a line a ray is at t, 0 or 1, decided as crossings are: by the t of the line.
TERRACAST_PACKET_INLINE double is_beyond(double line, double origin, double direction,
                                         double inverse, double t) {
  const double forward = truth(t >= (line - origin) * inverse);
  const double backward = 1.0 - forward;
  const double still = truth(origin >= line);
  const double moving = direction > 0.0 ? forward : backward;
  return direction == 0.0 ? still : moving;
}

constexpr int kLanes = RayLanes::kLanes;

/// Where rays come down to the height of the ground, or start below it.
struct Starts {
  Doubles t, x, y;
  LaneMask are_there;  ///< those that ever do
  LaneMask are_in_hint;
};

struct Rectangle {
  std::array<double, 2> x, y;
};

TERRACAST_PACKET_CODE
void find_starts(const Rectangle& hint, double above_all_z, const RayLanes& rays,
                 Starts& __restrict starts) {
  Doubles is_there, is_in_hint;
  const double x0 = hint.x[0];
  const double x1 = hint.x[1];
  const double y0 = hint.y[0];
  const double y1 = hint.y[1];
  for (int i = 0; i < kLanes; ++i) {
    const double dz = rays.direction_z[i];
    const double t_min = rays.t_min[i];
    const double t_down = larger(t_min, (above_all_z - rays.origin_z[i]) * rays.inverse_z[i]);
    const double t = dz < 0.0 ? t_down : t_min;
    const double z = rays.origin_z[i] + t * dz;
    const double x = rays.origin_x[i] + t * rays.direction_x[i];
    const double y = rays.origin_y[i] + t * rays.direction_y[i];
    starts.t[i] = t;
    starts.x[i] = x;
    starts.y[i] = y;
    is_there[i] = truth(((dz < 0.0) | (z <= above_all_z)) & (t <= rays.t_max[i]));
    is_in_hint[i] = truth((x > x0) & (x < x1) & (y > y0) & (y < y1));
  }
  Integers there, in_hint;
  set_integers(is_there, there);
  set_integers(is_in_hint, in_hint);
  starts.are_there = lanes_where(there);
  starts.are_in_hint = lanes_where(in_hint);
}

/// How rays pass through one tile, all of them as if they were in it.
struct Sides {
  Doubles t;        ///< where they leave it through a side
  Doubles is_x;     ///< by the western or eastern side
  Doubles t_exit;   ///< where they leave it or end
  Doubles t_top;    ///< as RayLanes::t_top
  Doubles meets;    ///< they may meet the ground there
  Doubles goes_on;  ///< they leave it before they end
};

TERRACAST_PACKET_INLINE void find_sides(const TileMap::Leaf& leaf, double above_all_z,
                                        const RayLanes& rays, Sides& sides) {
  const double x0 = leaf.x[0];
  const double x1 = leaf.x[1];
  const double y0 = leaf.y[0];
  const double y1 = leaf.y[1];
  const double highest_z = leaf.highest_z_world;
  for (int i = 0; i < kLanes; ++i) {
    const double side_x = rays.inverse_x[i] > 0.0 ? x1 : x0;
    const double side_y = rays.inverse_y[i] > 0.0 ? y1 : y0;
    const double t_x = (side_x - rays.origin_x[i]) * rays.inverse_x[i] + rays.never_x[i];
    const double t_y = (side_y - rays.origin_y[i]) * rays.inverse_y[i] + rays.never_y[i];
    sides.t[i] = smaller(t_x, t_y);
    sides.is_x[i] = truth(t_x <= t_y);
    sides.t_exit[i] = larger(smaller(sides.t[i], rays.t_max[i]), rays.t_entry[i]);
    sides.t_top[i] = (highest_z - rays.origin_z[i]) * rays.inverse_z[i] + rays.never_z[i];
  }
  for (int i = 0; i < kLanes; ++i) {
    const double dz = rays.direction_z[i];
    const double z_entry = rays.origin_z[i] + rays.t_entry[i] * dz;
    const double falls_in_time = truth(sides.t_top[i] <= sides.t_exit[i]);
    const double rises_late =
        truth((sides.t_top[i] >= rays.t_entry[i]) & ((dz > 0.0) | (rays.origin_z[i] <= highest_z)));
    sides.meets[i] = dz < 0.0 ? falls_in_time : rises_late;
    sides.goes_on[i] =
        truth((sides.t[i] < rays.t_max[i]) & ((dz < 0.0) | (z_entry <= above_all_z)));
  }
}

/// Indices into Leaf::beyond.
TERRACAST_PACKET_INLINE void find_ways_out(const TileMap::Leaf& leaf, const Sides& sides,
                                           const RayLanes& rays, Integers& ways) {
  const double x_middle = (leaf.x[0] + leaf.x[1]) / 2.0;
  const double y_middle = (leaf.y[0] + leaf.y[1]) / 2.0;
  Doubles way;
  for (int i = 0; i < kLanes; ++i) {
    const bool is_x = sides.is_x[i] > 0.0;
    const double middle = is_x ? y_middle : x_middle;
    const double origin = is_x ? rays.origin_y[i] : rays.origin_x[i];
    const double direction = is_x ? rays.direction_y[i] : rays.direction_x[i];
    const double inverse = is_x ? rays.inverse_y[i] : rays.inverse_x[i];
    const double half = is_beyond(middle, origin, direction, inverse, sides.t[i]);
    const double east = 2.0 * truth(rays.direction_x[i] > 0.0);
    const double north = 4.0 + 2.0 * truth(rays.direction_y[i] > 0.0);
    way[i] = (is_x ? east : north) + half;
  }
  set_integers(way, ways);
}

/// What becomes of rays in a tile.
struct Passing {
  LaneMask here;   ///< those that are in it
  LaneMask meets;  ///< they may meet the ground there
  LaneMask moves;  ///< they cannot, or have passed, and go on
};

/// Completes the passages of the rays in one tile.
/// passed   rays that have passed through it already
TERRACAST_PACKET_CODE
Passing pass_tile(const TileMap::Leaf& leaf, std::uint32_t tile, LaneMask asked, LaneMask passed,
                  double above_all_z, RayLanes& __restrict rays, Sides& __restrict sides) {
  Integers is_here, is_fresh;
  for (int i = 0; i < kLanes; ++i)
    is_here[i] = static_cast<std::int32_t>((asked >> i) & 1U & (rays.tile[i] == tile ? 1U : 0U));
  for (int i = 0; i < kLanes; ++i) is_fresh[i] = static_cast<std::int32_t>((~passed >> i) & 1U);
  find_sides(leaf, above_all_z, rays, sides);

  Doubles here, meets, moves;
  for (int i = 0; i < kLanes; ++i) here[i] = is_here[i];
  for (int i = 0; i < kLanes; ++i) {
    const double meets_first = sides.meets[i] * is_fresh[i];
    meets[i] = here[i] * meets_first;
    moves[i] = here[i] * sides.goes_on[i] * (1.0 - meets_first);
  }
  for (int i = 0; i < kLanes; ++i) {
    rays.t_exit[i] = here[i] > 0.0 ? sides.t_exit[i] : rays.t_exit[i];
    rays.t_top[i] = here[i] > 0.0 ? sides.t_top[i] : rays.t_top[i];
  }
  Integers does_meet, does_move;
  set_integers(meets, does_meet);
  set_integers(moves, does_move);
  return {.here = lanes_where(is_here),
          .meets = lanes_where(does_meet),
          .moves = lanes_where(does_move)};
}

/// Moves rays from a tile into those beyond.
/// returns   those of them for which there is none
TERRACAST_PACKET_CODE
LaneMask move_on(const TileMap::Leaf& leaf, const Sides& sides, LaneMask moving,
                 RayLanes& __restrict rays) {
  Integers ways;
  find_ways_out(leaf, sides, rays, ways);
  RayLanes::Field<std::uint32_t> beyond;
  for (int i = 0; i < kLanes; ++i) beyond[i] = leaf.beyond[static_cast<std::size_t>(ways[i])];
  Integers moves, is_out;
  for (int i = 0; i < kLanes; ++i) moves[i] = static_cast<std::int32_t>((moving >> i) & 1U);
  for (int i = 0; i < kLanes; ++i) is_out[i] = moves[i] & (beyond[i] == TileMap::kNone ? 1 : 0);
  for (int i = 0; i < kLanes; ++i) {
    const std::int32_t steps = moves[i] & ~is_out[i];
    const std::uint32_t old_tile = rays.tile[i];
    const std::int32_t old_side = rays.side[i];
    const std::int32_t new_side = (ways[i] >> 1) ^ 1;
    rays.tile[i] = steps != 0 ? beyond[i] : old_tile;
    rays.side[i] = steps != 0 ? new_side : old_side;
  }
  Doubles does_move;
  for (int i = 0; i < kLanes; ++i) does_move[i] = moves[i];
  for (int i = 0; i < kLanes; ++i) {
    const double t_entry = rays.t_entry[i];
    const double next = larger(sides.t[i], t_entry);
    rays.t_entry[i] = does_move[i] > 0.0 ? next : t_entry;
  }
  return lanes_where(is_out);
}

/// How low rays are in their passages through a tile at the lowest.
TERRACAST_PACKET_CODE
double find_lowest_z(const RayLanes& rays, const Sides& sides, LaneMask asked) {
  Integers is_asked;
  for (int i = 0; i < kLanes; ++i) is_asked[i] = static_cast<std::int32_t>((asked >> i) & 1U);
  Doubles counts, z;
  for (int i = 0; i < kLanes; ++i) counts[i] = is_asked[i];
  for (int i = 0; i < kLanes; ++i) {
    const double z_entry = rays.origin_z[i] + rays.t_entry[i] * rays.direction_z[i];
    const double z_exit = rays.origin_z[i] + sides.t_exit[i] * rays.direction_z[i];
    z[i] = counts[i] > 0.0 ? smaller(z_exit, z_entry) : kInfinity;
  }
  double lowest = kInfinity;
  for (int i = 0; i < kLanes; ++i) lowest = smaller(z[i], lowest);
  return lowest;
}

std::int32_t leaf_code(std::uint32_t leaf) { return -2 - static_cast<std::int32_t>(leaf); }

}  // namespace

TileMap::TileMap(const TileStore& store, const std::vector<CutTile>& cut, bool is_turned) {
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
    const double highest_z_world = is_turned ? -box.min().z() : box.max().z();
    leaves_.push_back({.x = {box.min().x(), box.max().x()},
                       .y = {box.min().y(), box.max().y()},
                       .highest_z_world = highest_z_world,
                       .beyond = {}});
    highest_z_world_ = std::max(highest_z_world_, highest_z_world);
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
  for (const Node& node : nodes_)
    if (std::find(node.children.begin(), node.children.end(), -1) != node.children.end())
      fail(ErrorKind::Input, "the cut has a hole around ({}, {}) of the world frame", node.x_middle,
           node.y_middle);
  find_neighbours(cut);
}

void TileMap::add_leaf(std::uint32_t leaf, const TileId& id) {
  TileId root = id;
  while (root.level < root_level_) root = root.parent();
  const std::int64_t row = root.y - root_y0_;
  std::int32_t* place =
      &root_grid_[static_cast<std::size_t>(row * num_roots_x_ + (root.x - root_x0_))];
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
    child = ((below.x & 1) != 0 ? 1U : 0U) + ((below.y & 1) != 0 ? 2U : 0U);
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
        leaf.beyond[2 * side + half] = beyond;
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
    code =
        node.children[(x_world >= node.x_middle ? 1U : 0U) + (y_world >= node.y_middle ? 2U : 0U)];
  }
  return code == -1 ? kNone : static_cast<std::uint32_t>(-2 - code);
}

std::uint32_t TileMap::leaf_on_ray(std::int32_t code, const RayLanes& rays, int i, double t) const {
  while (code >= 0) {
    const Node& node = nodes_[static_cast<std::size_t>(code)];
    const double east =
        is_beyond(node.x_middle, rays.origin_x[i], rays.direction_x[i], rays.inverse_x[i], t);
    const double north =
        is_beyond(node.y_middle, rays.origin_y[i], rays.direction_y[i], rays.inverse_y[i], t);
    code = node.children[static_cast<std::size_t>(east + 2.0 * north)];
  }
  return code == -1 ? kNone : static_cast<std::uint32_t>(-2 - code);
}

bool TileMap::enter_root(RayLanes& rays, int i, double t, bool is_start) const {
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
    if (!clip(root.x0, root.x1, rays.origin_x[i], rays.direction_x[i], rays.inverse_x[i], 0))
      continue;
    if (!clip(root.y0, root.y1, rays.origin_y[i], rays.direction_y[i], rays.inverse_y[i], 2))
      continue;
    // A start within a rounding of a border is in the root or before it, by the t of its sides. Of a
    // ray that goes on, one that is left at t has been passed already.
    if (is_start) t_in = std::max(t_in, t);
    if (t_in < t || t_in > t_end || t_end <= t || t_in > rays.t_max[i] || t_in >= nearest_t)
      continue;
    nearest_t = t_in;
    nearest = &root;
    nearest_side = side;
  }
  if (nearest == nullptr) return false;
  const std::uint32_t leaf = leaf_on_ray(nearest->node, rays, i, nearest_t);
  if (leaf == kNone) return false;
  rays.tile[i] = leaf;
  rays.side[i] = nearest_side;
  rays.t_entry[i] = nearest_t;
  return true;
}

double TileMap::above_all_z(const RayTrail* trail) const {
  return highest_z_world_ + (trail != nullptr ? RayTrail::kFollowed_m : kAboveAll_m);
}

LaneMask TileMap::enter(RayLanes& rays, LaneMask asked, std::uint32_t& hint,
                        RayTrail* trail) const {
  Starts starts;
  const Leaf& hinted = leaves_[hint];
  find_starts({.x = {hinted.x[0], hinted.x[1]}, .y = {hinted.y[0], hinted.y[1]}},
              above_all_z(trail), rays, starts);
  for (int i = 0; i < kLanes; ++i) {
    rays.tile[i] = hint;
    rays.side[i] = -1;
    rays.t_entry[i] = rays.t_exit[i] = rays.t_top[i] = starts.t[i];
  }
  asked &= starts.are_there;
  int last = -1;  // lane that was looked up before
  for_each_lane(asked & ~starts.are_in_hint, [&](int i) {
    // Of a viewer on a side of its tile all rays start at one place.
    const bool is_same =
        last >= 0 && starts.x[i] == starts.x[last] && starts.y[i] == starts.y[last];
    const std::optional<std::uint32_t> tile =
        is_same ? hint : tile_at_place(starts.x[i], starts.y[i]);
    if (tile) {
      rays.tile[i] = hint = *tile;
      last = i;
    } else if (!enter_root(rays, i, starts.t[i], true)) {
      asked &= ~lane_bit(i);
    }
  });
  const LaneMask there = go_to_ground(rays, asked, 0, trail);
  rays.may_be_on_surface = 0;
  for_each_lane(there, [&](int i) {
    const double way_m = (rays.t_entry[i] - rays.t_min[i]) * rays.length_m[i];
    if (rays.side[i] < 0 || way_m <= kStartsAtSide_m) rays.may_be_on_surface |= lane_bit(i);
  });
  return there;
}

LaneMask TileMap::go_on(RayLanes& rays, LaneMask asked, RayTrail* trail) const {
  return go_to_ground(rays, asked, asked, trail);
}

LaneMask TileMap::go_to_ground(RayLanes& rays, LaneMask asked, LaneMask passed,
                               RayTrail* trail) const {
  LaneMask there = 0;
  while (asked != 0) {
    // Nearly always all of them are in the same tile.
    const std::uint32_t tile = rays.tile[__builtin_ctz(asked)];
    Sides sides;
    const Passing passing =
        pass_tile(leaves_[tile], tile, asked, passed, above_all_z(trail), rays, sides);
    const LaneMask above = passing.here & ~passing.meets & ~passed;
    if (trail != nullptr && above != 0) trail->pass(tile, find_lowest_z(rays, sides, above));
    there |= passing.meets;
    asked &= ~passing.here;
    passed &= ~passing.here;
    if (passing.moves == 0) continue;
    const LaneMask goes_out = move_on(leaves_[tile], sides, passing.moves, rays);
    asked |= passing.moves & ~goes_out;
    for_each_lane(goes_out, [&](int i) {
      if (!is_rectangle_ && enter_root(rays, i, sides.t[i], false)) asked |= lane_bit(i);
    });
  }
  return there;
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
