#include "labels/shown_objects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "geo/geodesy.h"
#include "world/lod.h"
#include "world/tile_map.h"

namespace terracast::labels {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;
using Eigen::Vector3d;
using world::kHeightStep_m;

double doubled_area(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return (b - a).cross(c - a).norm();
}

/// z of the cross product of (b - a) and (c - a).
double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const Vector2d along = b - a;
  const Vector2d across = c - a;
  return along.x() * across.y() - along.y() * across.x();
}

/// Corners of the convex hull, anticlockwise (A. M. Andrew, Information Processing Letters 9, 1979).
std::vector<Vector2d> convex_hull(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  std::vector<Vector2d> hull;
  const auto add_chain = [&](auto begin, auto end) {
    const std::size_t first = hull.size();
    for (auto point = begin; point != end; ++point) {
      while (hull.size() >= first + 2 && turn(hull[hull.size() - 2], hull.back(), *point) <= 0.0)
        hull.pop_back();
      hull.push_back(*point);
    }
    hull.pop_back();  // the next chain begins with it
  };
  add_chain(points.begin(), points.end());
  add_chain(points.rbegin(), points.rend());
  return hull;
}

/// A rectangle in the plane.
struct Rectangle {
  Vector2d along = Vector2d::UnitX();
  Vector2d low = Vector2d::Zero(), high = Vector2d::Zero();  ///< along it and to the left of it
  double area() const { return (high - low).prod(); }
};

Rectangle rectangle_along(std::span<const Vector2d> hull, const Vector2d& along) {
  Rectangle rectangle{.along = along};
  rectangle.low.setConstant(std::numeric_limits<double>::infinity());
  rectangle.high = -rectangle.low;
  for (const Vector2d& point : hull) {
    const Vector2d place(point.dot(along), along.x() * point.y() - along.y() * point.x());
    rectangle.low = rectangle.low.cwiseMin(place);
    rectangle.high = rectangle.high.cwiseMax(place);
  }
  return rectangle;
}

/// One side of it lies along a side of the hull (H. Freeman and R. Shapira, Communications of the ACM 18,
/// 1975). Hulls of objects have few corners: all sides are tried.
Rectangle smallest_rectangle(std::span<const Vector2d> hull) {
  Rectangle best = rectangle_along(hull, Vector2d::UnitX());
  // A rotation by a rounding is not worth another box.
  constexpr double kLess = 1.0 - 1e-12;
  double best_area = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size() && hull.size() > 1; ++i) {
    const Vector2d side = hull[(i + 1) % hull.size()] - hull[i];
    const Rectangle one = rectangle_along(hull, side.normalized());
    if (!(one.area() < kLess * best_area)) continue;
    best = one;
    best_area = one.area();
  }
  return best;
}

/// The same rectangle along its longer side, toward larger x, or y where it is level across.
Rectangle along_longer_side(std::span<const Vector2d> hull, const Rectangle& rectangle) {
  const Vector2d size = rectangle.high - rectangle.low;
  Vector2d along = rectangle.along;
  if (size.y() > size.x()) along = {-along.y(), along.x()};
  constexpr double kRounding = 1e-12;
  if (along.x() < -kRounding || (std::abs(along.x()) <= kRounding && along.y() < 0.0))
    along = -along;
  return rectangle_along(hull, along);
}

/// The level of the cut at a place.
class CutLevels {
 public:
  CutLevels(const world::TileStore& store, std::vector<world::CutTile> cut)
      : cut_(std::move(cut)), map_(store, cut_) {}
  std::optional<int> at(double x_world, double y_world) const {
    const std::optional<std::uint32_t> tile = map_.tile_at_place(x_world, y_world);
    if (!tile) return std::nullopt;
    return cut_[*tile].id.level;
  }

 private:
  std::vector<world::CutTile> cut_;
  world::TileMap map_;
};

world::TileId id_of(const capture::ShownTile& tile) { return {tile.level, tile.x, tile.y}; }

/// Rays that meet an object were cast at a tile that holds it.
std::vector<world::TileId> touched_tiles(const capture::SequenceInfo& info,
                                         const std::vector<capture::FrameRecord>& frames) {
  std::set<int> touched;
  for (const capture::FrameRecord& frame : frames)
    touched.insert(frame.touched_tiles.begin(), frame.touched_tiles.end());
  std::vector<world::TileId> tiles;
  for (const int tile : touched)
    tiles.push_back(id_of(info.geometry.tiles.at(static_cast<std::size_t>(tile))));
  return tiles;
}

std::string layer_name(const world::TileStore& store, const world::Provenance& provenance) {
  const auto& layers = store.manifest().layers;
  if (provenance.layer >= layers.size())
    fail(ErrorKind::Input, "{}: a tile names layer {}, and the manifest lists {}; tile it again",
         store.folder().string(), provenance.layer, layers.size());
  return layers[provenance.layer].name;
}

/// Shapes of prototypes, each made once for each level that is shown.
class Prototypes {
 public:
  explicit Prototypes(const world::TileStore& store) : store_(store) {}

  struct Shown {
    std::string name;
    std::shared_ptr<const LoneShape> shape;  ///< null: a tile of the level does not show it
  };
  Shown at(std::size_t row, int tile_level) {
    const auto known = levels_.find({row, tile_level});
    if (known != levels_.end()) return known->second;
    const world::Prototype prototype = store_.load_prototype(row);
    Shown shown{.name = prototype.name, .shape = nullptr};
    for (const world::ShapeLevel& level : prototype.levels) {
      if (tile_level > level.coarsest_level) continue;
      auto& made = shapes_[{row, level.coarsest_level}];
      if (!made) made = std::make_shared<const LoneShape>(level.shape, Eigen::Vector3i::Zero());
      shown.shape = made;
      break;
    }
    return levels_[{row, tile_level}] = shown;
  }

 private:
  const world::TileStore& store_;
  std::map<std::pair<std::size_t, int>, Shown> levels_;
  std::map<std::pair<std::size_t, int>, std::shared_ptr<const LoneShape>> shapes_;
};

/// The box of a prototype along its own axes.
capture::OrientedBox box_of_instance(const LoneShape& shape, const world::InstanceFrame& frame) {
  Eigen::AlignedBox3d bounds;
  for (const Vector3d& vertex : shape.vertices()) bounds.extend(vertex);
  return {.world_from_box = {frame.world_from_prototype, frame * bounds.center()},
          .half_size_m = 0.5 * frame.scale * bounds.sizes()};
}

/// Fills objects from tiles one after the other.
class ObjectFinder {
 public:
  ObjectFinder(const world::TileStore& store, CutLevels levels,
               const std::vector<std::uint32_t>& ids)
      : store_(store),
        frame_(store.manifest().origin),
        levels_(std::move(levels)),
        prototypes_(store),
        ids_(ids),
        objects_(ids.size()) {}

  void take(const world::Tile& tile) {
    for (const world::Solid& solid : tile.objects.solids)
      if (ShownObject* object = wanted(solid.provenance)) take(solid, *object);
    for (const world::Instance& instance : tile.objects.instances)
      if (ShownObject* object = wanted(instance.provenance)) take(instance, *object);
  }

  std::vector<ShownObject> finish(const std::string& sequence) && {
    for (std::size_t i = 0; i < objects_.size(); ++i)
      if (objects_[i].parts.empty())
        fail(ErrorKind::Input,
             "{}: {} shows object {}, which is not in its tiles; give the world that it was "
             "rendered "
             "from",
             store_.folder().string(), sequence, ids_[i]);
    return std::move(objects_);
  }

 private:
  /// Null: not asked for, or found already in another tile over which it reaches.
  ShownObject* wanted(const world::Provenance& provenance) {
    const auto found = std::lower_bound(ids_.begin(), ids_.end(), provenance.instance_id);
    if (found == ids_.end() || *found != provenance.instance_id) return nullptr;
    ShownObject& object = objects_[static_cast<std::size_t>(found - ids_.begin())];
    return object.parts.empty() ? &object : nullptr;
  }

  void describe(const world::Provenance& provenance, ShownObject& object) const {
    object.label.instance_id = provenance.instance_id;
    object.label.semantic_class = object.parts[0].shape->semantic_class();
    object.label.layer = layer_name(store_, provenance);
    object.label.feature = provenance.feature;
  }

  void take(const world::Solid& solid, ShownObject& object) const {
    const std::optional<int> level = levels_.at(solid.place_m.x(), solid.place_m.y());
    const world::Shape* shape = level ? world::shape_at(solid.levels, *level) : nullptr;
    if (shape == nullptr) return;
    object.parts = {
        {.shape = std::make_shared<const LoneShape>(*shape, solid.origin_steps), .frame = {}}};
    describe(solid.provenance, object);
    const Vector3d place_world = solid.origin_steps.cast<double>() * kHeightStep_m;
    object.label.box =
        smallest_upright_box(object.parts[0].shape->vertices(), frame_.world_from_enu(place_world));
  }

  void take(const world::Instance& instance, ShownObject& object) {
    const Vector3d place_world = instance.place_steps.cast<double>() * kHeightStep_m;
    const std::optional<int> level = levels_.at(place_world.x(), place_world.y());
    if (!level || *level > instance.coarsest_level) return;
    const Prototypes::Shown shown = prototypes_.at(instance.prototype, *level);
    if (shown.shape == nullptr) return;
    const world::InstanceFrame frame = world::instance_frame(instance, frame_);
    object.parts = {{.shape = shown.shape, .frame = frame}};
    describe(instance.provenance, object);
    object.label.prototype = shown.name;
    object.label.box = box_of_instance(*shown.shape, frame);
  }

  const world::TileStore& store_;
  geo::WorldFrame frame_;
  CutLevels levels_;
  Prototypes prototypes_;
  const std::vector<std::uint32_t>& ids_;
  std::vector<ShownObject> objects_;
};

}  // namespace

LoneShape::LoneShape(const world::Shape& shape, const Eigen::Vector3i& origin_steps) {
  std::vector<std::uint32_t> own(shape.vertices_steps.size(), 0xffffffffU);
  const auto own_vertex = [&](std::uint32_t corner) {
    if (own[corner] == 0xffffffffU) {
      own[corner] = static_cast<std::uint32_t>(vertices_.size());
      vertices_.push_back((origin_steps + shape.vertices_steps[corner]).cast<double>() *
                          kHeightStep_m);
    }
    return own[corner];
  };
  std::vector<geo::Box3d> boxes;
  std::map<core::SemanticClass, double> areas;
  for (const world::Shape::Triangle& triangle : shape.triangles) {
    std::array<std::uint32_t, 3> corners;
    geo::Box3d& box = boxes.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = own_vertex(triangle.corners[k]);
      box.extend(vertices_[corners[k]]);
    }
    for (std::size_t k = 0; k < 3; ++k)
      edges_.push_back(
          {std::min(corners[k], corners[(k + 1) % 3]), std::max(corners[k], corners[(k + 1) % 3])});
    areas[shape.finishes.at(triangle.finish).semantic_class] +=
        doubled_area(vertices_[corners[0]], vertices_[corners[1]], vertices_[corners[2]]);
  }
  std::sort(edges_.begin(), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  double most = -1.0;
  for (const auto& [semantic_class, area] : areas) {
    if (!(area > most)) continue;
    most = area;
    semantic_class_ = semantic_class;
  }
  world::BoxTree::Leaves leaves;
  tree_ = world::BoxTree(boxes, world::TriangleBlock::kTriangles, leaves);
  blocks_.resize(leaves.leaves.size());
  for (std::size_t leaf = 0; leaf < blocks_.size(); ++leaf) {
    const auto [begin, end] = leaves.leaves[leaf];
    blocks_[leaf].count = end - begin;
    for (std::uint32_t lane = 0; lane < world::TriangleBlock::kTriangles; ++lane) {
      const std::uint32_t triangle = leaves.order[std::min(begin + lane, end - 1)];
      const auto& corners = shape.triangles[triangle].corners;
      blocks_[leaf].set(static_cast<int>(lane),
                        {origin_steps + shape.vertices_steps[corners[0]],
                         origin_steps + shape.vertices_steps[corners[1]],
                         origin_steps + shape.vertices_steps[corners[2]]},
                        triangle);
    }
  }
}

bool LoneShape::is_met(const Vector3d& origin, const Vector3d& direction) const {
  if (tree_.is_empty()) return false;
  const double length = direction.norm();
  const Vector3d inverse(world::safe_inverse(direction.x(), length),
                         world::safe_inverse(direction.y(), length),
                         world::safe_inverse(direction.z(), length));
  world::BoxTree::Ray ray;
  if (!tree_.enter(origin, direction, inverse, length, 0.0, std::numeric_limits<double>::infinity(),
                   ray))
    return false;
  const world::ShearedRay sheared(origin, direction);
  bool is_met = false;
  tree_.traverse(ray, [&](std::uint32_t leaf, float) {
    world::BlockCrossings crossings;
    world::cross_block(sheared, blocks_[leaf], crossings);
    for (; crossings.crossed != 0 && !is_met; crossings.crossed &= crossings.crossed - 1)
      is_met = crossings.t[__builtin_ctz(crossings.crossed)] >= 0.0;
    return is_met;
  });
  return is_met;
}

std::vector<world::CutTile> cut_of(const world::TileStore& store,
                                   const capture::SequenceInfo& info) {
  std::vector<world::TileId> leaves;
  for (const capture::ShownTile& tile : info.geometry.tiles) {
    const world::TileInfo* found = store.find(id_of(tile));
    if (found == nullptr || found->content_hash != tile.content_hash)
      fail(ErrorKind::Input,
           "{} {} tile {} that {} was captured with; give the world that the capture was "
           "rendered from",
           store.folder().string(), found == nullptr ? "lacks" : "has another content in",
           id_of(tile).name(), info.name);
    leaves.push_back(id_of(tile));
  }
  return world::with_coarser_sides(leaves);
}

std::vector<ShownObject> find_objects(const world::TileStore& store,
                                      const capture::SequenceInfo& info,
                                      const std::vector<capture::FrameRecord>& frames,
                                      const std::vector<std::uint32_t>& ids) {
  const std::vector<world::TileId> tiles = touched_tiles(info, frames);
  ObjectFinder finder(store, CutLevels(store, cut_of(store, info)), ids);
  if (ids.empty()) return {};
  constexpr int kAhead = 8;  // tiles in memory
  std::vector<std::optional<world::Tile>> loaded(tiles.size());
  core::parallel_in_order(
      static_cast<std::int64_t>(tiles.size()), kAhead,
      [&](std::int64_t i) {
        loaded[static_cast<std::size_t>(i)] = store.load(tiles[static_cast<std::size_t>(i)]);
      },
      [&](std::int64_t i) {
        finder.take(*loaded[static_cast<std::size_t>(i)]);
        loaded[static_cast<std::size_t>(i)].reset();
      });
  return std::move(finder).finish(info.name);
}

capture::OrientedBox smallest_upright_box(std::span<const Vector3d> points_world,
                                          const Eigen::Matrix3d& world_from_level) {
  TERRACAST_CHECK(!points_world.empty(), "a box around nothing");
  // About one of them: far from the world's origin digits would be lost.
  const Vector3d& base = points_world.front();
  std::vector<Vector2d> level;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const Vector3d& point : points_world) {
    const Vector3d place = world_from_level.transpose() * (point - base);
    level.push_back(place.head<2>());
    low = std::min(low, place.z());
    high = std::max(high, place.z());
  }
  const std::vector<Vector2d> hull = convex_hull(std::move(level));
  const Rectangle best = along_longer_side(hull, smallest_rectangle(hull));
  Eigen::Matrix3d level_from_box = Eigen::Matrix3d::Identity();
  level_from_box.col(0).head<2>() = best.along;
  level_from_box.col(1).head<2>() = Vector2d(-best.along.y(), best.along.x());
  const Vector2d middle = 0.5 * (best.low + best.high);
  const Vector3d center_box(middle.x(), middle.y(), 0.5 * (low + high));
  const Eigen::Matrix3d world_from_box = world_from_level * level_from_box;
  return {.world_from_box = {Eigen::Quaterniond(world_from_box).normalized(),
                             base + world_from_box * center_box},
          .half_size_m = {0.5 * (best.high.x() - best.low.x()),
                          0.5 * (best.high.y() - best.low.y()), 0.5 * (high - low)}};
}

}  // namespace terracast::labels
