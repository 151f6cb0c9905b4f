#include "validate/oracle/exact_world.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <list>
#include <map>
#include <mutex>
#include <queue>
#include <unordered_map>

#include "core/error.h"
#include "validate/oracle/box_tree.h"
#include "validate/oracle/exact_crossing.h"
#include "validate/oracle/exact_objects.h"
#include "validate/oracle/plain_floats.h"
#include "world/tile_store.h"

namespace terracast::oracle {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kBlockCells = 16;  ///< along a side of the cells that share a tree
constexpr int kBlocks = TileSurface::kCells / kBlockCells;

enum Side { kWest, kEast, kSouth, kNorth, kNumSides };
constexpr int kSteps[kNumSides][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};

/// By how much a bed may lie below the tile's lowest surface: heights lie within 8192 m of a tile's centre.
constexpr double kDeepest_m = 16384.0;

Kernel::Point_3 cgal(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

Ground ground_of(world::Cover cover) {
  switch (cover) {
    case world::Cover::Sea:
      return Ground::Sea;
    case world::Cover::Outside:
      return Ground::Outside;
    case world::Cover::Lake:
      return Ground::Lake;
    case world::Cover::River:
      return Ground::River;
    default:
      return Ground::Land;
  }
}

bool is_water(Ground ground) {
  return ground == Ground::Sea || ground == Ground::Lake || ground == Ground::River;
}

/// What of a world a ray may meet.
enum class Sheet : std::uint8_t {
  Whole,           ///< the surface and what stands on it
  Bed,             ///< the same without water
  WaterFromBelow,  ///< the surface of waters alone, where a ray leaves it
};

/// The triangles of some cells in a tree.
struct Block {
  Triangles triangles;
  Tree tree;
};

/// A tile that is loaded.
struct LoadedTile {
  TileSurface surface;
  std::unique_ptr<const ExactObjects> objects;  ///< null: none
  std::unique_ptr<const ExactPaint> paint;      ///< null: none
  std::array<std::array<double, 2>, static_cast<std::size_t>(kBlocks) * kBlocks> block_z;
  std::array<std::once_flag, static_cast<std::size_t>(kBlocks) * kBlocks> is_made;
  std::array<std::unique_ptr<Block>, static_cast<std::size_t>(kBlocks) * kBlocks> blocks;
  std::atomic<std::size_t> num_bytes = 0;

  Box block_box(int bx, int by) const {
    const double side_m = kBlockCells * surface.spacing_m;
    const auto& z = block_z[static_cast<std::size_t>(by * kBlocks + bx)];
    const double x = surface.west_world + bx * side_m;
    const double y = surface.south_world + by * side_m;
    return {{x, y, z[0]}, {x + side_m, y + side_m, z[1]}};
  }

  Facet facet(std::uint32_t leaf, int i, int j, bool is_upper) const {
    Facet facet{.leaf = leaf, .i = i, .j = j, .is_upper = is_upper, .corners = {}};
    const auto at = corners_of(i, j, is_upper);
    for (std::size_t k = 0; k < 3; ++k) facet.corners[k] = surface.vertex_world(at[k][0], at[k][1]);
    return facet;
  }

  /// returns   whether it was made now
  bool make_block(int bx, int by) {
    bool is_new = false;
    const auto index = static_cast<std::size_t>(by * kBlocks + bx);
    std::call_once(is_made[index], [&] {
      auto block = std::make_unique<Block>();
      constexpr std::size_t kTriangles = std::size_t{2} * kBlockCells * kBlockCells;
      block->triangles.reserve(kTriangles);
      for (int k = 0; k < static_cast<int>(kTriangles); ++k) {
        const Facet f = facet(0, bx * kBlockCells + k / 2 % kBlockCells,
                              by * kBlockCells + k / 2 / kBlockCells, k % 2 == 1);
        block->triangles.emplace_back(cgal(f.corners[0]), cgal(f.corners[1]), cgal(f.corners[2]));
      }
      block->tree.insert(block->triangles.cbegin(), block->triangles.cend());
      block->tree.build();
      blocks[index] = std::move(block);
      // A node of the tree holds a box and two pointers.
      num_bytes += sizeof(Block) + kTriangles * (sizeof(Kernel::Triangle_3) + sizeof(Primitive) +
                                                 sizeof(CGAL::Bbox_3) + 2 * sizeof(void*));
      is_new = true;
    });
    return is_new;
  }
};

struct Leaf {
  TileKey key;
  Box box;
  std::array<int, kNumSides> neighbour_levels{};
};

/// A tile of the tree above the leaves.
struct Node {
  Box box;
  std::vector<std::uint32_t> children;  ///< nodes
  std::int64_t leaf = -1;
};

/// What a ray may still meet.
struct Ahead {
  double entry;
  enum Kind : std::uint8_t { kNode, kObjects, kBlock } kind;
  std::uint32_t index;  ///< of the node, or of the leaf
  std::uint16_t block;
  bool operator>(const Ahead& other) const {
    return std::tuple(entry, kind, index, block) >
           std::tuple(other.entry, other.kind, other.index, other.block);
  }
};

}  // namespace

std::array<double, 3> ExactHit::weights_at(double x_world, double y_world) const {
  const double along_x =
      (x_world - corners_world[0].x()) / (corners_world[1].x() - corners_world[0].x());
  const double along_y =
      (y_world - corners_world[0].y()) / (corners_world[2].y() - corners_world[0].y());
  return {1.0 - along_x - along_y, along_x, along_y};
}

struct ExactWorld::Impl {
  Impl(const WorldFolder& world, std::span<const TileKey> tiles, WorldFromEnu world_from_enu,
       Sheet sheet, std::size_t memory_bytes)
      : world_(world),
        world_from_enu_(std::move(world_from_enu)),
        sheet_(sheet),
        memory_bytes_(memory_bytes) {
    if (sheet != Sheet::WaterFromBelow) prototypes_.emplace(world.store());
    const world::TileStore& store = world.store();
    std::map<TileKey, std::uint32_t> leaf_of;
    for (const TileKey& key : tiles) {
      const world::TileInfo* info = store.find({key.level, key.x, key.y});
      if (info == nullptr)
        core::fail(core::ErrorKind::Input, "{}: the world has no tile {}", world.folder().string(),
                   key.name());
      if (!leaf_of.emplace(key, leaves_.size()).second) continue;
      const double side_m = std::ldexp(256.0, key.level);
      leaves_.push_back(
          {.key = key,
           .box = {{key.x * side_m, key.y * side_m,
                    info->lowest_z_world - (sheet == Sheet::Bed ? kDeepest_m : 0.0)},
                   {(key.x + 1) * side_m, (key.y + 1) * side_m, info->highest_z_world}}});
    }
    for (Leaf& leaf : leaves_)
      for (int side = 0; side < kNumSides; ++side) {
        const TileKey beside{leaf.key.level, leaf.key.x + kSteps[side][0],
                             leaf.key.y + kSteps[side][1]};
        if (leaf_of.contains(beside.parent()))
          leaf.neighbour_levels[static_cast<std::size_t>(side)] = 1;
        for (int quadrant = 0; quadrant < 4; ++quadrant)
          if (leaf_of.contains(beside.child(quadrant)))
            leaf.neighbour_levels[static_cast<std::size_t>(side)] = -1;
      }
    make_tree(store.manifest().coarsest_level);
    for (const auto& [key, leaf] : leaf_of) {
      index_.emplace(key, leaf);
      finest_level_ = std::min(finest_level_, key.level);
      coarsest_level_ = std::max(coarsest_level_, key.level);
    }
  }

  /// Level of the tile that holds a place.
  std::optional<int> level_at(double x_world, double y_world) const {
    for (int level = finest_level_; level <= coarsest_level_; ++level) {
      const double side_m = std::ldexp(256.0, level);
      if (index_.contains({level, static_cast<int>(std::floor(x_world / side_m)),
                           static_cast<int>(std::floor(y_world / side_m))}))
        return level;
    }
    return std::nullopt;
  }

  void make_tree(int coarsest_level) {
    std::map<TileKey, std::uint32_t> node_of;
    const auto node_at = [&](const TileKey& key) {
      const auto [found, is_new] = node_of.emplace(key, static_cast<std::uint32_t>(nodes_.size()));
      if (is_new) nodes_.emplace_back();
      return std::pair(found->second, is_new);
    };
    for (std::uint32_t i = 0; i < leaves_.size(); ++i) {
      TileKey key = leaves_[i].key;
      auto [node, is_new] = node_at(key);
      nodes_[node].leaf = i;
      nodes_[node].box.grow(leaves_[i].box);
      while (key.level < coarsest_level) {
        key = key.parent();
        const auto [above, above_is_new] = node_at(key);
        if (is_new) nodes_[above].children.push_back(node);
        nodes_[above].box.grow(leaves_[i].box);
        node = above;
        is_new = above_is_new;
      }
      if (is_new) roots_.push_back(node);
    }
  }

  // ---- tiles

  std::shared_ptr<LoadedTile> load(std::uint32_t leaf_index) const {
    const Leaf& leaf = leaves_[leaf_index];
    const world::Tile tile = world_.store().load(
        {leaf.key.level, leaf.key.x, leaf.key.y},
        sheet_ == Sheet::Bed ? world::WaterDepth::Read : world::WaterDepth::LeftOut);
    auto loaded = std::make_shared<LoadedTile>();
    TileSurface& surface = loaded->surface;
    surface.key = leaf.key;
    surface.spacing_m = std::ldexp(1.0, leaf.key.level);
    surface.west_world = leaf.box.lowest.x();
    surface.south_world = leaf.box.lowest.y();
    surface.center_z_m = tile.center_z_m;
    std::vector<std::int32_t> steps = tile.height_steps;
    surface.grounds.reserve(tile.cover.size());
    for (const world::Cover cover : tile.cover) surface.grounds.push_back(ground_of(cover));
    drain(tile.water_depth_steps, steps, surface.grounds);
    stitch(steps, leaf.neighbour_levels, surface.half_steps);
    find_block_heights(*loaded);
    loaded->num_bytes = sizeof(LoadedTile) + surface.half_steps.size() * sizeof(std::int32_t) +
                        surface.grounds.size() * sizeof(Ground);
    if (prototypes_ && (!tile.objects.solids.empty() || !tile.objects.instances.empty())) {
      loaded->objects = std::make_unique<const ExactObjects>(
          tile, *prototypes_, [this](double x, double y) { return level_at(x, y); },
          world_from_enu_);
      loaded->num_bytes += loaded->objects->num_bytes();
    }
    if (!tile.objects.strips.empty() || !tile.objects.areas.empty()) {
      loaded->paint = std::make_unique<const ExactPaint>(tile.objects.strips, tile.objects.areas);
      loaded->num_bytes += loaded->paint->num_bytes();
    }
    ++num_tiles_read_;
    return loaded;
  }

  /// Lowers the heights of a tile to the bed of its waters.
  /// depths   empty: it has none, or is seen with them
  static void drain(const std::vector<std::int32_t>& depths, std::vector<std::int32_t>& steps,
                    std::vector<Ground>& grounds) {
    for (std::size_t i = 0; i < depths.size(); ++i) {
      steps[i] -= depths[i];
      if (is_water(grounds[i])) grounds[i] = Ground::Seabed;
    }
  }

  /// Heights in half steps, where means are whole numbers.
  static void stitch(const std::vector<std::int32_t>& steps,
                     const std::array<int, kNumSides>& neighbour_levels,
                     std::vector<std::int32_t>& half_steps) {
    constexpr int kLast = TileSurface::kCells;
    half_steps.resize(steps.size());
    for (int j = 0; j <= kLast; ++j)
      for (int i = 0; i <= kLast; ++i) {
        const std::size_t at = TileSurface::sample(i, j);
        const bool is_beside_coarser_row = (j == 0 && neighbour_levels[kSouth] > 0) ||
                                           (j == kLast && neighbour_levels[kNorth] > 0);
        const bool is_beside_coarser_column =
            (i == 0 && neighbour_levels[kWest] > 0) || (i == kLast && neighbour_levels[kEast] > 0);
        if (is_beside_coarser_row && i % 2 == 1)
          half_steps[at] =
              steps[TileSurface::sample(i - 1, j)] + steps[TileSurface::sample(i + 1, j)];
        else if (is_beside_coarser_column && j % 2 == 1)
          half_steps[at] =
              steps[TileSurface::sample(i, j - 1)] + steps[TileSurface::sample(i, j + 1)];
        else
          half_steps[at] = 2 * steps[at];
      }
  }

  static void find_block_heights(LoadedTile& tile) {
    for (int by = 0; by < kBlocks; ++by)
      for (int bx = 0; bx < kBlocks; ++bx) {
        double lowest = kInfinity;
        double highest = -kInfinity;
        for (int j = by * kBlockCells; j <= (by + 1) * kBlockCells; ++j)
          for (int i = bx * kBlockCells; i <= (bx + 1) * kBlockCells; ++i) {
            const double z = tile.surface.vertex_world(i, j).z();
            lowest = std::min(lowest, z);
            highest = std::max(highest, z);
          }
        tile.block_z[static_cast<std::size_t>(by * kBlocks + bx)] = {lowest, highest};
      }
  }

  /// A tile in memory, read when it is not; those used longest ago make room.
  std::shared_ptr<LoadedTile> tile(std::uint32_t leaf) const {
    if (auto found = find(leaf)) return found;
    const std::lock_guard reading(reading_[leaf % reading_.size()]);
    if (auto found = find(leaf)) return found;  // another thread was first
    std::shared_ptr<LoadedTile> loaded = load(leaf);
    const std::lock_guard lock(mutex_);
    used_.push_front({leaf, loaded});
    where_[leaf] = used_.begin();
    keep_to_memory();
    return loaded;
  }

  /// Lets go of the tiles used longest ago; the one used last stays. The mutex is held.
  void keep_to_memory() const {
    std::size_t sum = 0;
    for (auto entry = used_.begin(); entry != used_.end();) {
      const std::size_t num_bytes = entry->second->num_bytes;
      if (sum + num_bytes <= memory_bytes_ || entry == used_.begin()) {
        sum += num_bytes;
        ++entry;
        continue;
      }
      where_.erase(entry->first);
      entry = used_.erase(entry);
    }
    peak_bytes_ = std::max(peak_bytes_, sum);
  }

  void make_block(LoadedTile& tile, int bx, int by) const {
    if (!tile.make_block(bx, by)) return;
    ++num_trees_;
    const std::lock_guard lock(mutex_);
    keep_to_memory();
  }

  std::shared_ptr<LoadedTile> find(std::uint32_t leaf) const {
    const std::lock_guard lock(mutex_);
    const auto found = where_.find(leaf);
    if (found == where_.end()) return nullptr;
    used_.splice(used_.begin(), used_, found->second);
    return found->second->second;
  }

  // ---- rays

  std::optional<ExactHit> first_hit(const ExactRay& ray, double t_max) const {
    const PlainFloats plain;
    TERRACAST_CHECK(ray.origin_world.allFinite() && ray.through_world.allFinite() &&
                        ray.origin_world != ray.through_world,
                    "a ray from ({}, {}, {}) through ({}, {}, {})", ray.origin_world.x(),
                    ray.origin_world.y(), ray.origin_world.z(), ray.through_world.x(),
                    ray.through_world.y(), ray.through_world.z());
    ++num_rays_;
    const Eigen::Vector3d direction_world = ray.through_world - ray.origin_world;
    const BoxRay boxes(ray.origin_world, direction_world, kMargin_m);
    const Kernel::Ray_3 exact_ray(cgal(ray.origin_world), cgal(ray.through_world));
    std::priority_queue<Ahead, std::vector<Ahead>, std::greater<>> ahead;
    const auto look_at_node = [&](std::uint32_t node) {
      const double entry = boxes.entry(nodes_[node].box, t_max);
      if (entry < kInfinity) ahead.push({entry, Ahead::kNode, node, 0});
    };
    for (const std::uint32_t root : roots_) look_at_node(root);
    std::optional<Crossing> best;
    NearestObject object(ray);
    const auto nearest_t = [&] { return std::min(best ? best->high() : kInfinity, object.high()); };
    std::shared_ptr<LoadedTile> held;  // the tile of the last block, most often the next one's too
    std::int64_t held_leaf = -1;
    const auto hold = [&](std::uint32_t leaf) -> LoadedTile& {
      if (held_leaf != leaf) held = tile(leaf);
      held_leaf = leaf;
      return *held;
    };
    std::vector<Primitive::Id> met;
    while (!ahead.empty()) {
      const Ahead next = ahead.top();
      ahead.pop();
      if (next.entry > nearest_t()) break;
      if (next.kind == Ahead::kNode) {
        const Node& node = nodes_[next.index];
        for (const std::uint32_t child : node.children) look_at_node(child);
        if (node.leaf < 0) continue;
        const auto leaf = static_cast<std::uint32_t>(node.leaf);
        LoadedTile& in = hold(leaf);
        if (in.objects) ahead.push({next.entry, Ahead::kObjects, leaf, 0});
        for (int by = 0; by < kBlocks; ++by)
          for (int bx = 0; bx < kBlocks; ++bx) {
            const double entry = boxes.entry(in.block_box(bx, by), t_max);
            if (entry < kInfinity)
              ahead.push(
                  {entry, Ahead::kBlock, leaf, static_cast<std::uint16_t>(by * kBlocks + bx)});
          }
        continue;
      }
      LoadedTile& in = hold(next.index);
      if (next.kind == Ahead::kObjects) {
        in.objects->visit(
            ray.origin_world, direction_world, std::min(t_max, nearest_t()),
            [&](const ObjectFacet& facet) { object.meet(facet, leaves_[next.index].box); });
        continue;
      }
      const int bx = next.block % kBlocks;
      const int by = next.block / kBlocks;
      make_block(in, bx, by);
      const Block& block = *in.blocks[next.block];
      met.clear();
      block.tree.all_intersected_primitives(exact_ray, std::back_inserter(met));
      for (const Primitive::Id& triangle : met) {
        const auto k = static_cast<int>(triangle - block.triangles.cbegin());
        const Crossing crossing(ray, in.facet(next.index, bx * kBlockCells + k / 2 % kBlockCells,
                                              by * kBlockCells + k / 2 / kBlockCells, k % 2 == 1));
        if (crossing.is_within_plane()) continue;
        if (sheet_ == Sheet::WaterFromBelow && !leaves_water(ray, crossing, in)) continue;
        if (!best || crossing.is_before(*best)) best = crossing;
      }
    }
    if (object.is_before(best)) return object.hit(t_max);
    if (!best) return std::nullopt;
    return hit_of(ray, *best, t_max, hold(best->facet().leaf));
  }

  /// Whether a ray comes up through a facet where water counts most.
  static bool leaves_water(const ExactRay& ray, const Crossing& crossing, const LoadedTile& tile) {
    if (!(crossing.normal().dot(ray.through_world - ray.origin_world) > 0.0)) return false;
    ExactHit hit;
    set_ground(crossing.facet(), tile, hit);
    const Eigen::Vector3d point = exact_point(ray, crossing.exact());
    const std::array<double, 3> weights = hit.weights_at(point.x(), point.y());
    const auto most = std::max_element(weights.begin(), weights.end()) - weights.begin();
    return is_water(hit.grounds[static_cast<std::size_t>(most)]);
  }

  static void set_ground(const Facet& facet, const LoadedTile& tile, ExactHit& hit) {
    hit.corners_world = facet.corners;
    const auto at = corners_of(facet.i, facet.j, facet.is_upper);
    for (std::size_t k = 0; k < 3; ++k)
      hit.grounds[k] = tile.surface.grounds[TileSurface::sample(at[k][0], at[k][1])];
  }

  std::optional<ExactHit> hit_of(const ExactRay& ray, const Crossing& crossing, double t_max,
                                 const LoadedTile& tile) const {
    const mpq_class t = crossing.exact();
    if (t_max < kInfinity && t > mpq_class(t_max)) return std::nullopt;
    const Facet& facet = crossing.facet();
    ExactHit hit;
    hit.t = t.get_d();
    hit.point_world = exact_point(ray, t);
    hit.normal_world = crossing.normal().normalized();
    hit.tile = leaves_[facet.leaf].key;
    hit.cell_x = facet.i;
    hit.cell_y = facet.j;
    hit.is_upper = facet.is_upper;
    set_ground(facet, tile, hit);
    if (tile.paint) hit.paint = tile.paint->at(hit.point_world.head<2>());
    return hit;
  }

  WorldFolder world_;
  WorldFromEnu world_from_enu_;
  std::optional<PrototypeShapes> prototypes_;  ///< nothing: of the ground alone
  Sheet sheet_;
  std::size_t memory_bytes_;
  int finest_level_ = std::numeric_limits<int>::max();
  int coarsest_level_ = std::numeric_limits<int>::min();
  std::vector<Leaf> leaves_;
  std::map<TileKey, std::uint32_t> index_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> roots_;

  using Used = std::list<std::pair<std::uint32_t, std::shared_ptr<LoadedTile>>>;
  mutable std::mutex mutex_;
  mutable std::array<std::mutex, 64> reading_;
  mutable Used used_;
  mutable std::unordered_map<std::uint32_t, Used::iterator> where_;
  mutable std::size_t peak_bytes_ = 0;
  mutable std::atomic<std::uint64_t> num_rays_ = 0, num_tiles_read_ = 0, num_trees_ = 0;
};

ExactWorld::ExactWorld(const WorldFolder& world, std::span<const TileKey> tiles,
                       WorldFromEnu world_from_enu, Viewers viewers, std::size_t memory_bytes) {
  const bool is_in_water = viewers == Viewers::InWater;
  const std::size_t bytes = is_in_water ? memory_bytes / 2 : memory_bytes;
  impl_ = std::make_unique<Impl>(world, tiles, std::move(world_from_enu),
                                 is_in_water ? Sheet::Bed : Sheet::Whole, bytes);
  if (is_in_water)
    surface_of_water_ =
        std::make_unique<Impl>(world, tiles, WorldFromEnu(), Sheet::WaterFromBelow, bytes);
}

ExactWorld::~ExactWorld() = default;

std::optional<ExactHit> ExactWorld::first_hit(const ExactRay& ray, double t_max) const {
  if (!surface_of_water_) return impl_->first_hit(ray, t_max);
  // Without the surface a ray would go on to what stands kilometres beyond it.
  const std::optional<ExactHit> surface = surface_of_water_->first_hit(ray, t_max);
  const std::optional<ExactHit> bed = impl_->first_hit(ray, surface ? surface->t : t_max);
  return bed ? bed : surface;
}

std::shared_ptr<const TileSurface> ExactWorld::surface(const TileKey& tile) const {
  const std::shared_ptr<LoadedTile> loaded = impl_->tile(impl_->index_.at(tile));
  return {loaded, &loaded->surface};
}

bool ExactWorld::is_in_water(const WorldFolder& world, std::span<const TileKey> tiles,
                             const Eigen::Vector3d& place_world) {
  // Straight up to the surface of a water, and to nothing else.
  const Impl surface(world, tiles, WorldFromEnu(), Sheet::WaterFromBelow, kDefaultMemory_bytes);
  return surface.first_hit({place_world, place_world + Eigen::Vector3d::UnitZ()}, kInfinity)
      .has_value();
}

std::array<int, 4> ExactWorld::neighbour_levels(const TileKey& tile) const {
  return impl_->leaves_[impl_->index_.at(tile)].neighbour_levels;
}

ExactWorld::Stats ExactWorld::stats() const {
  Stats sum;
  for (const Impl* impl : {impl_.get(), surface_of_water_.get()}) {
    if (impl == nullptr) continue;
    const std::lock_guard lock(impl->mutex_);
    sum.num_rays += impl->num_rays_;
    sum.num_tiles_read += impl->num_tiles_read_;
    sum.num_trees += impl->num_trees_;
    sum.peak_bytes += impl->peak_bytes_;
  }
  return sum;
}

}  // namespace terracast::oracle
