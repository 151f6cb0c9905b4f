#include "world/nearest_surface.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "core/error.h"
#include "world/instance_frame.h"
#include "world/lod.h"
#include "world/terrain_triangle.h"

namespace terracast::world {
namespace {

/// Heights of a tile are half steps: stitched sides are means.
constexpr double kHalfStep_m = 0.5 * kHeightStep_m;
/// Cells along the side of a block whose heights are known to lie between two.
constexpr int kBlockCells = 16;
constexpr int kBlocks = kTileCells / kBlockCells;
static_assert(kBlocks * kBlockCells == kTileCells);
/// How much farther than a point's reach tiles are listed, so that they stay so for the points after it.
constexpr double kListedAround_m = 500.0;
/// More than roundings of boxes.
constexpr double kBoxRounding_m = 1e-6;

/// The level of the cut's tile that holds a place, by which objects are shown; nullopt: no tile does.
using LevelAt = std::function<std::optional<int>(const Eigen::Vector2d& place_world)>;

bool is_finer(const CutTile& a, const CutTile& b) { return a.id.level < b.id.level; }

int finest_level(const std::vector<CutTile>& cut) {
  TERRACAST_CHECK(!cut.empty(), "a cut without tiles");
  return std::min_element(cut.begin(), cut.end(), is_finer)->id.level;
}

int coarsest_level(const std::vector<CutTile>& cut) {
  return std::max_element(cut.begin(), cut.end(), is_finer)->id.level;
}

Eigen::Vector3d nearest_on_side(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
                                const Eigen::Vector3d& to) {
  const Eigen::Vector3d side = to - from;
  const double length2 = side.squaredNorm();
  const double along = length2 > 0.0 ? side.dot(point - from) / length2 : 0.0;
  return from + std::clamp(along, 0.0, 1.0) * side;
}

// By the regions of space whose nearest point is a corner, on a side or inside (Ericson, Real-Time Collision Detection,
// 2005, section 5.1.5).
Eigen::Vector3d nearest_by_regions(const Eigen::Vector3d& point,
                                   const std::array<Eigen::Vector3d, 3>& corners) {
  const Eigen::Vector3d &a = corners[0], &b = corners[1], &c = corners[2];
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = point - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return a;
  const Eigen::Vector3d bp = point - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + d1 / (d1 - d3) * ab;
  const Eigen::Vector3d cp = point - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0)
    return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const double sum = va + vb + vc;
  return a + vb / sum * ab + vc / sum * ac;
}

}  // namespace

Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& point,
                                    const std::array<Eigen::Vector3d, 3>& corners) {
  const Eigen::Vector3d ab = corners[1] - corners[0], ac = corners[2] - corners[0];
  const Eigen::Vector3d by_regions = nearest_by_regions(point, corners);
  // The plane of a triangle that is nearly a line is uncertain, and its sides are as near.
  constexpr double kSliver = 1e-6;  // of the sine of its angle, squared
  if (ab.cross(ac).squaredNorm() > kSliver * ab.squaredNorm() * ac.squaredNorm()) return by_regions;
  Eigen::Vector3d nearest = by_regions.allFinite() ? by_regions : corners[0];
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d place = nearest_on_side(point, corners[k], corners[(k + 1) % 3]);
    if ((place - point).squaredNorm() < (nearest - point).squaredNorm()) nearest = place;
  }
  return nearest;
}

/// A tile of the cut as it is shown: its ground in blocks, and its objects.
struct SurfaceFinder::LoadedTile {
  struct Block {
    geo::Box3d box_world;
    int i = 0, j = 0;  ///< of its first cell
  };
  /// An object that the tile shows. Its shape is a solid's own, about the solid's origin, or a prototype's.
  struct Object {
    geo::Box3d box_world;
    Provenance provenance;
    std::shared_ptr<const Shape> own_shape;
    const Shape* shape;
    InstanceFrame frame;
  };

  LoadedTile(const TileStore& store, const CutTile& of, const PrototypeLibrary& prototypes,
             const geo::WorldFrame& frame, const TileMap& map, const std::vector<CutTile>& cut);

  Eigen::Vector3d sample_world(int i, int j) const {
    return {corner_world.x() + i * spacing_m, corner_world.y() + j * spacing_m,
            center_z_m + kHalfStep_m * half_steps[Tile::sample(i, j)]};
  }

  Eigen::Vector2d corner_world;
  double spacing_m;
  double center_z_m;
  std::vector<std::int32_t> half_steps;
  std::vector<Cover> cover;
  std::vector<Block> blocks;
  std::vector<Object> objects;

 private:
  void add_blocks();
  void add_solids(std::vector<Solid>& solids, const LevelAt& level_at);
  void add_instances(const std::vector<Instance>& instances, const PrototypeLibrary& prototypes,
                     const geo::WorldFrame& frame, const LevelAt& level_at,
                     const std::string& where);
};

SurfaceFinder::LoadedTile::LoadedTile(const TileStore& store, const CutTile& of,
                                      const PrototypeLibrary& prototypes,
                                      const geo::WorldFrame& frame, const TileMap& map,
                                      const std::vector<CutTile>& cut) {
  Tile tile = store.load(of.id);
  corner_world = of.id.corner_world();
  spacing_m = of.id.spacing_m();
  center_z_m = tile.center_z_m;
  half_steps = stitched_half_steps(tile, of.coarser_sides);
  cover = std::move(tile.cover);
  add_blocks();
  const auto level_at = [&](const Eigen::Vector2d& place) -> std::optional<int> {
    const std::optional<std::uint32_t> there = map.tile_at_place(place.x(), place.y());
    return there ? std::optional(cut[*there].id.level) : std::nullopt;
  };
  add_solids(tile.objects.solids, level_at);
  add_instances(tile.objects.instances, prototypes, frame, level_at,
                tile_path(store.folder(), of.id).string());
}

void SurfaceFinder::LoadedTile::add_blocks() {
  for (int row = 0; row < kBlocks; ++row)
    for (int column = 0; column < kBlocks; ++column) {
      Block& block = blocks.emplace_back();
      block.i = column * kBlockCells;
      block.j = row * kBlockCells;
      for (int j = block.j; j <= block.j + kBlockCells; ++j)
        for (int i = block.i; i <= block.i + kBlockCells; ++i)
          block.box_world.extend(sample_world(i, j));
    }
}

void SurfaceFinder::LoadedTile::add_solids(std::vector<Solid>& solids, const LevelAt& level_at) {
  for (Solid& solid : solids) {
    const std::optional<int> level = level_at(solid.place_m.cast<double>());
    const Shape* shown = level ? shape_at(solid.levels, *level) : nullptr;
    if (shown == nullptr) continue;
    Object object{.box_world = {},
                  .provenance = solid.provenance,
                  .own_shape = std::make_shared<const Shape>(*shown),
                  .shape = nullptr,
                  .frame = {}};
    object.shape = object.own_shape.get();
    object.frame.place_world = solid.origin_steps.cast<double>() * kHeightStep_m;
    for (const Eigen::Vector3i& vertex : shown->vertices_steps)
      object.box_world.extend(object.frame * (vertex.cast<double>() * kHeightStep_m));
    objects.push_back(std::move(object));
  }
}

void SurfaceFinder::LoadedTile::add_instances(const std::vector<Instance>& instances,
                                              const PrototypeLibrary& prototypes,
                                              const geo::WorldFrame& frame, const LevelAt& level_at,
                                              const std::string& where) {
  for (const Instance& instance : instances) {
    if (instance.prototype >= prototypes.size())
      core::fail(core::ErrorKind::Input,
                 "{}: object {} is an instance of prototype {}; the world has {}; tile the world "
                 "again",
                 where, instance.provenance.instance_id, instance.prototype, prototypes.size());
    const Eigen::Vector2d place = instance.place_steps.head<2>().cast<double>() * kHeightStep_m;
    const std::optional<int> level = level_at(place);
    if (!level || *level > instance.coarsest_level) continue;
    const PrototypeLibrary::Shown* shown = prototypes.shown_at(instance.prototype, *level);
    if (shown == nullptr || shown->mesh.bounds().isEmpty()) continue;
    Object object{.box_world = {},
                  .provenance = instance.provenance,
                  .own_shape = nullptr,
                  .shape = &shown->shape,
                  .frame = instance_frame(instance, frame)};
    for (int corner = 0; corner < 8; ++corner)
      object.box_world.extend(
          object.frame * shown->mesh.bounds().corner(static_cast<geo::Box3d::CornerType>(corner)));
    objects.push_back(std::move(object));
  }
}

/// One query. Only what may be nearer than the nearest so far is looked at.
class SurfaceFinder::Search {
 public:
  Search(const Eigen::Vector3d& point_world, double reach_m)
      : point_(point_world), nearest_m_(reach_m) {}

  bool comes_near(const geo::Box3d& box_world) const { return distance_to(box_world) < nearest_m_; }
  double distance_to(const geo::Box3d& box_world) const {
    return std::sqrt(box_world.squaredExteriorDistance(point_)) - kBoxRounding_m;
  }

  void look_at(const LoadedTile& tile) {
    from_near_to_far(tile.blocks, [&](const LoadedTile::Block& block) { look_at(tile, block); });
    from_near_to_far(tile.objects, [&](const LoadedTile::Object& object) { look_at(object); });
  }

  const std::optional<NearestSurface>& nearest() const { return nearest_; }

 private:
  /// Calls look for those whose boxes are nearer than the nearest so far.
  template <class Things, class Look>
  void from_near_to_far(const Things& things, const Look& look) {
    std::vector<std::pair<double, std::size_t>> near;
    for (std::size_t i = 0; i < things.size(); ++i)
      if (const double near_m = distance_to(things[i].box_world); near_m < nearest_m_)
        near.emplace_back(near_m, i);
    std::sort(near.begin(), near.end());
    for (const auto& [near_m, i] : near) {
      if (!(near_m < nearest_m_)) return;
      look(things[i]);
    }
  }

  void look_at(const LoadedTile& tile, const LoadedTile::Block& block) {
    for (int j = block.j; j < block.j + kBlockCells; ++j)
      for (int i = block.i; i < block.i + kBlockCells; ++i)
        for (const bool is_upper : {false, true}) {
          const TrianglePlace triangle = place_on_triangle(i, j, is_upper, 0.5, 0.5);
          std::array<Eigen::Vector3d, 3> corners;
          for (std::size_t k = 0; k < corners.size(); ++k)
            corners[k] = tile.sample_world(triangle.corners[k].i, triangle.corners[k].j);
          if (!take(corners, {}, 1.0)) continue;
          const auto nearest_corner = std::min_element(
              triangle.corners.begin(), triangle.corners.end(),
              [&](const TrianglePlace::Corner& a, const TrianglePlace::Corner& b) {
                return (tile.sample_world(a.i, a.j) - nearest_->place_world).squaredNorm() <
                       (tile.sample_world(b.i, b.j) - nearest_->place_world).squaredNorm();
              });
          nearest_->cover = tile.cover[nearest_corner->sample()];
        }
  }

  // In the shape's own frame, whose lengths are the world's divided by the scale.
  void look_at(const LoadedTile::Object& object) {
    const InstanceFrame& frame = object.frame;
    const Eigen::Vector3d point =
        frame.world_from_prototype.conjugate() * (point_ - frame.place_world) / frame.scale;
    for (const Shape::Triangle& triangle : object.shape->triangles) {
      std::array<Eigen::Vector3d, 3> corners;
      for (std::size_t k = 0; k < corners.size(); ++k)
        corners[k] =
            object.shape->vertices_steps[triangle.corners[k]].cast<double>() * kHeightStep_m;
      if (take(corners, point, frame.scale)) {
        nearest_->place_world = frame * nearest_->place_world;
        nearest_->object = object.provenance;
      }
    }
  }

  /// Keeps a triangle's nearest point, in the corners' frame, where it is nearer than the nearest so far.
  /// point   in the corners' frame; nullopt: that is the world's
  /// scale   metres of the world in one of the corners' frame
  bool take(const std::array<Eigen::Vector3d, 3>& corners,
            const std::optional<Eigen::Vector3d>& point, double scale) {
    const Eigen::Vector3d& from = point ? *point : point_;
    const Eigen::Vector3d place = nearest_on_triangle(from, corners);
    const double distance_m = scale * (place - from).norm();
    if (!(distance_m < nearest_m_)) return false;
    nearest_m_ = distance_m;
    nearest_ = NearestSurface{.distance_m = distance_m, .place_world = place};
    return true;
  }

  Eigen::Vector3d point_;
  double nearest_m_;
  std::optional<NearestSurface> nearest_;
};

SurfaceFinder::SurfaceFinder(const TileStore& store, std::vector<CutTile> cut)
    : store_(store),
      cut_(std::move(cut)),
      map_(store, cut_),
      frame_(store.manifest().origin),
      prototypes_(store, finest_level(cut_), coarsest_level(cut_)) {}

SurfaceFinder::~SurfaceFinder() = default;

void SurfaceFinder::look_around(const Eigen::Vector3d& point_world, double reach_m) {
  if ((point_world - near_place_).norm() + reach_m <= near_reach_m_) return;
  near_place_ = point_world;
  near_reach_m_ = reach_m + kListedAround_m;
  near_.clear();
  for (std::uint32_t i = 0; i < cut_.size(); ++i)
    if (store_.find(cut_[i].id)->box_world().exteriorDistance(point_world) <=
        near_reach_m_ + kBoxRounding_m)
      near_.push_back(i);
  std::erase_if(loaded_, [&](const auto& tile) {
    return !std::binary_search(near_.begin(), near_.end(), tile.first);
  });
}

const SurfaceFinder::LoadedTile& SurfaceFinder::loaded(std::uint32_t tile) {
  std::unique_ptr<const LoadedTile>& place = loaded_[tile];
  if (place == nullptr)
    place = std::make_unique<const LoadedTile>(store_, cut_[tile], prototypes_, frame_, map_, cut_);
  return *place;
}

std::optional<NearestSurface> SurfaceFinder::find(const Eigen::Vector3d& point_world,
                                                  double reach_m) {
  TERRACAST_CHECK(point_world.allFinite() && reach_m >= 0.0, "the surface nearest to nowhere");
  look_around(point_world, reach_m);
  Search search(point_world, reach_m);
  std::vector<std::pair<double, std::uint32_t>> tiles;
  for (const std::uint32_t tile : near_)
    if (const double near_m = search.distance_to(store_.find(cut_[tile].id)->box_world());
        near_m < reach_m)
      tiles.emplace_back(near_m, tile);
  std::sort(tiles.begin(), tiles.end());
  for (const auto& [near_m, tile] : tiles)
    if (search.comes_near(store_.find(cut_[tile].id)->box_world())) search.look_at(loaded(tile));
  return search.nearest();
}

std::optional<double> SurfaceFinder::height_above_ground_m(const Eigen::Vector3d& point_world) {
  const std::optional<std::uint32_t> there = map_.tile_at_place(point_world.x(), point_world.y());
  if (!there) return std::nullopt;
  const LoadedTile& tile = loaded(*there);
  const Eigen::Vector2d at = (point_world.head<2>() - tile.corner_world) / tile.spacing_m;
  const int i = std::clamp(static_cast<int>(std::floor(at.x())), 0, kTileCells - 1);
  const int j = std::clamp(static_cast<int>(std::floor(at.y())), 0, kTileCells - 1);
  const double fx = at.x() - i, fy = at.y() - j;
  const TrianglePlace place = place_on_triangle(i, j, fx + fy > 1.0, fx, fy);
  double z_world = 0.0;
  for (std::size_t k = 0; k < place.corners.size(); ++k)
    z_world += place.weights[k] * tile.sample_world(place.corners[k].i, place.corners[k].j).z();
  return point_world.z() - z_world;
}

}  // namespace terracast::world
