#include "world/lod.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "core/error.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

using TileSet = std::unordered_set<TileId>;

struct Side {
  TileSide bit;
  int dx;
  int dy;
};
constexpr std::array<Side, 4> kSides = {
    {{kWest, -1, 0}, {kEast, 1, 0}, {kSouth, 0, -1}, {kNorth, 0, 1}}};

double outside_m(double lowest, double highest, double at_lowest, double at_highest) {
  return std::max({lowest - at_highest, 0.0, at_lowest - highest});
}

/// The places from which a viewpoint sees.
struct Places {
  const Eigen::Vector3d& lowest;
  const Eigen::Vector3d& highest;

  explicit Places(const Viewpoint& viewpoint)
      : lowest(viewpoint.sheaf ? viewpoint.sheaf->starts_box_world().min()
                               : viewpoint.position_world),
        highest(viewpoint.sheaf ? viewpoint.sheaf->starts_box_world().max()
                                : viewpoint.position_world) {}
};

/// The square of the distance from a tile to a viewpoint in the x-y plane: never more than that to
/// its box, nor than that of a descendant (each operation here is monotone, so that this holds for
/// the rounded values too).
double squared_distance_xy_m2(const TileId& id, const Places& from) {
  const Eigen::Vector2d corner = id.corner_world();
  const double dx =
      outside_m(corner.x(), corner.x() + id.side_m(), from.lowest.x(), from.highest.x());
  const double dy =
      outside_m(corner.y(), corner.y() + id.side_m(), from.lowest.y(), from.highest.y());
  return dx * dx + dy * dy;
}

/// Whether cells of a spacing span more pixels than the options allow, however far they are.
bool is_too_coarse(double spacing_m, const RaySheaf& sheaf, const DetailOptions& options) {
  return spacing_m * sheaf.pixels_per_m() > options.cell_px;
}

/// Whether cells of a spacing at a distance span more pixels than the options allow.
bool is_too_coarse(double spacing_m, double squared_distance_m2, const Viewpoint& viewpoint,
                   const DetailOptions& options) {
  const double spacing_px_m = spacing_m * viewpoint.pixels_per_radian;
  return spacing_px_m * spacing_px_m > options.cell_px * options.cell_px * squared_distance_m2;
}

std::vector<TileId> sorted(const TileSet& tiles) {
  std::vector<TileId> result(tiles.begin(), tiles.end());
  std::sort(result.begin(), result.end());
  return result;
}

/// The leaf at `level` or coarser that holds a tile, if there is one.
const TileId* leaf_above(const TileSet& leaves, TileId id, int level, int coarsest_level) {
  while (id.level < level) id = id.parent();
  for (; id.level <= coarsest_level; id = id.parent()) {
    const auto found = leaves.find(id);
    if (found != leaves.end()) return &*found;
  }
  return nullptr;
}

int coarsest_of(const std::vector<TileId>& leaves) {
  return std::max_element(leaves.begin(), leaves.end())->level;
}

bool has_all_children(const TileStore& store, const TileId& id) {
  for (int quadrant = 0; quadrant < 4; ++quadrant)
    if (store.find(id.child(quadrant)) == nullptr) return false;
  return true;
}

/// Leaves before balancing, and those of them that are wanted finer than the store has them.
struct Leaves {
  std::vector<TileId> all;
  std::vector<TileId> too_coarse;
};

void collect_leaves(const TileStore& store, const TileInfo& tile,
                    std::span<const Viewpoint> viewpoints, const DetailOptions& options,
                    Leaves& leaves) {
  const bool is_wanted_finer = wants_refinement(tile, viewpoints, options);
  if (!is_wanted_finer || !has_all_children(store, tile.id)) {
    leaves.all.push_back(tile.id);
    if (is_wanted_finer) leaves.too_coarse.push_back(tile.id);
    return;
  }
  std::vector<Viewpoint> near;  // those that could want a child refined
  for (const Viewpoint& viewpoint : viewpoints) {
    const double spacing_m = tile.id.spacing_m() / 2;
    const double distance2 = squared_distance_xy_m2(tile.id, Places(viewpoint));
    if (is_too_coarse(spacing_m, distance2, viewpoint, options) ||
        (viewpoint.sheaf && is_too_coarse(spacing_m, *viewpoint.sheaf, options)))
      near.push_back(viewpoint);
  }
  for (int quadrant = 0; quadrant < 4; ++quadrant)
    collect_leaves(store, *store.find(tile.id.child(quadrant)), near, options, leaves);
}

void collect_finest(const TileStore& store, const TileId& id, std::vector<TileId>& leaves) {
  if (!has_all_children(store, id)) {
    leaves.push_back(id);
    return;
  }
  for (int quadrant = 0; quadrant < 4; ++quadrant)
    collect_finest(store, id.child(quadrant), leaves);
}

std::vector<CutTile> balanced_cut(const TileStore& store, const std::vector<TileId>& leaves) {
  const std::vector<TileId> balanced = balance(leaves);
  for (const TileId& id : balanced)
    if (store.find(id) == nullptr)
      fail(
          ErrorKind::Input,
          "{}: the world has no tile {}, which a neighbour needs that is finer by two levels; tile "
          "the world again",
          store.folder().string(), id.name());
  return with_coarser_sides(balanced);
}

std::vector<const TileInfo*> roots_of(const TileStore& store) {
  std::vector<const TileInfo*> roots;
  for (const TileInfo& tile : store.manifest().tiles)
    if (tile.id.level == store.manifest().coarsest_level) roots.push_back(&tile);
  if (roots.empty())
    fail(ErrorKind::Input, "{}: the world has no tile of its coarsest level {}; tile it again",
         store.folder().string(), store.manifest().coarsest_level);
  return roots;
}

Leaves leaves_for(const TileStore& store, std::span<const Viewpoint> viewpoints,
                  const DetailOptions& options) {
  Leaves leaves;
  for (const TileInfo* root : roots_of(store))
    collect_leaves(store, *root, viewpoints, options, leaves);
  return leaves;
}

}  // namespace

RaySheaf::RaySheaf(const std::array<Eigen::Vector3d, 4>& starts_world,
                   const std::array<Eigen::Vector3d, 4>& directions_world, double pixels_per_m)
    : starts_(starts_world), directions_(directions_world), pixels_per_m_(pixels_per_m) {
  for (const Eigen::Vector3d& start : starts_) starts_box_.extend(start);
  edges_ = {starts_[1] - starts_[0], starts_[3] - starts_[0]};
  edges_.insert(edges_.end(), directions_.begin(), directions_.end());
}

/// Whether a plane across an axis stands between the two.
bool RaySheaf::is_apart(const geo::Box3d& box_world, const Eigen::Vector3d& axis) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double box_middle = axis.dot(box_world.center());
  const double box_reach = axis.cwiseAbs().dot(0.5 * box_world.sizes());
  double lowest = kInfinity;
  double highest = -kInfinity;
  for (const Eigen::Vector3d& start : starts_) {
    lowest = std::min(lowest, axis.dot(start));
    highest = std::max(highest, axis.dot(start));
  }
  for (const Eigen::Vector3d& direction : directions_) {
    const double along = axis.dot(direction);
    if (along < 0.0) lowest = -kInfinity;
    if (along > 0.0) highest = kInfinity;
  }
  return box_middle + box_reach < lowest || box_middle - box_reach > highest;
}

// Two convex bodies of planes are apart when a plane stands between them that is parallel to a face of one, or to an
// edge of each.
bool RaySheaf::meets(const geo::Box3d& box_world) const {
  for (int k = 0; k < 3; ++k)
    if (is_apart(box_world, Eigen::Vector3d::Unit(k))) return false;
  for (std::size_t i = 0; i < edges_.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (is_apart(box_world, edges_[i].cross(edges_[j]))) return false;
  for (const Eigen::Vector3d& edge : edges_)
    for (int k = 0; k < 3; ++k)
      if (is_apart(box_world, edge.cross(Eigen::Vector3d::Unit(k)))) return false;
  return true;
}

void DetailOptions::validate() const {
  int exponent = 0;
  if (std::frexp(finest_spacing_m, &exponent) != 0.5)
    fail(ErrorKind::Config,
         "finest_spacing_m = {} is not a power of two; {} and {} would be the nearest ones",
         finest_spacing_m, std::ldexp(1.0, exponent - 1), std::ldexp(1.0, exponent));
}

int DetailOptions::finest_level() const { return std::ilogb(finest_spacing_m); }

bool wants_refinement(const TileInfo& tile, std::span<const Viewpoint> viewpoints,
                      const DetailOptions& options) {
  if (tile.id.level <= options.finest_level()) return false;
  const double spacing_m = tile.id.spacing_m();
  return std::any_of(viewpoints.begin(), viewpoints.end(), [&](const Viewpoint& viewpoint) {
    const Places from(viewpoint);
    const double dz =
        outside_m(tile.lowest_z_world, tile.highest_z_world, from.lowest.z(), from.highest.z());
    const double distance2 = squared_distance_xy_m2(tile.id, from) + dz * dz;
    return is_too_coarse(spacing_m, distance2, viewpoint, options) ||
           (viewpoint.sheaf && is_too_coarse(spacing_m, *viewpoint.sheaf, options) &&
            viewpoint.sheaf->meets(tile.box_world()));
  });
}

std::vector<TileId> balance(const std::vector<TileId>& leaves) {
  if (leaves.empty()) return {};
  const int coarsest_level = coarsest_of(leaves);
  TileSet balanced(leaves.begin(), leaves.end());
  std::vector<TileId> to_check = leaves;
  while (!to_check.empty()) {
    const TileId id = to_check.back();
    to_check.pop_back();
    if (!balanced.contains(id)) continue;  // split since
    for (const Side& side : kSides) {
      const TileId beside = id.neighbour(side.dx, side.dy);
      while (const TileId* found = leaf_above(balanced, beside, id.level + 2, coarsest_level)) {
        const TileId too_coarse = *found;
        balanced.erase(too_coarse);
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
          balanced.insert(too_coarse.child(quadrant));
          to_check.push_back(too_coarse.child(quadrant));
        }
      }
    }
  }
  return sorted(balanced);
}

std::vector<CutTile> with_coarser_sides(const std::vector<TileId>& leaves) {
  const TileSet set(leaves.begin(), leaves.end());
  std::vector<CutTile> cut;
  cut.reserve(leaves.size());
  for (const TileId& id : leaves) {
    CutTile tile{.id = id};
    for (const Side& side : kSides)
      if (set.contains(id.neighbour(side.dx, side.dy).parent()))
        tile.coarser_sides |= static_cast<std::uint8_t>(side.bit);
    cut.push_back(tile);
  }
  std::sort(cut.begin(), cut.end(), [](const CutTile& a, const CutTile& b) { return a.id < b.id; });
  return cut;
}

std::vector<CutTile> choose_cut(const TileStore& store, std::span<const Viewpoint> viewpoints,
                                const DetailOptions& options) {
  return balanced_cut(store, leaves_for(store, viewpoints, options).all);
}

std::optional<TileId> missing_detail(const TileStore& store, std::span<const Viewpoint> viewpoints,
                                     const DetailOptions& options) {
  const std::vector<TileId> too_coarse = leaves_for(store, viewpoints, options).too_coarse;
  if (too_coarse.empty()) return std::nullopt;
  return too_coarse.front();
}

std::vector<CutTile> finest_cut(const TileStore& store) {
  std::vector<TileId> leaves;
  for (const TileInfo* root : roots_of(store)) collect_finest(store, root->id, leaves);
  return balanced_cut(store, leaves);
}

std::vector<std::int32_t> stitched_half_steps(const Tile& tile, std::uint8_t coarser_sides) {
  std::vector<std::int32_t> half_steps(tile.height_steps.size());
  std::transform(tile.height_steps.begin(), tile.height_steps.end(), half_steps.begin(),
                 [](std::int32_t steps) { return 2 * steps; });
  const auto stitch = [&](std::size_t first, std::size_t stride) {
    for (std::size_t k = 1; k < kTileSamples; k += 2) {
      const std::size_t at = first + k * stride;
      half_steps[at] = tile.height_steps[at - stride] + tile.height_steps[at + stride];
    }
  };
  if ((coarser_sides & kWest) != 0) stitch(Tile::sample(0, 0), kTileSamples);
  if ((coarser_sides & kEast) != 0) stitch(Tile::sample(kTileCells, 0), kTileSamples);
  if ((coarser_sides & kSouth) != 0) stitch(Tile::sample(0, 0), 1);
  if ((coarser_sides & kNorth) != 0) stitch(Tile::sample(0, kTileCells), 1);
  return half_steps;
}

}  // namespace terracast::world
