#include "validate/world_check/ground_check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "validate/world_check/solid_contact.h"

namespace terracast::world_check {
namespace {

using Eigen::Vector2d;
using world::kHeightStep_m;

constexpr int kBuckets = 64;
/// Between what stands upon or beside another: containers, walls.
constexpr double kSeam_m = 0.05;
/// Of a building what lies within so much of its lowest point is its foot.
constexpr double kFoot_m = 0.5;

/// Heights between the samples of a tile differ from those that things were put on by what the tile leaves out:
/// a part of its spacing on slopes up to 1, more on steeper ones, whose detail grows with them.
double tolerance_m(const world::TileId& id, double slope) {
  return 0.3 + 0.35 * id.spacing_m() * std::max(slope, 1.0);
}

class Ground {
 public:
  /// is_bed   below water its bed, not its surface
  Ground(const world::Tile& tile, bool is_bed)
      : tile_(tile), is_bed_(is_bed && !tile.water_depth_steps.empty()) {}

  double z_world(const Vector2d& place) const {
    const Cell cell = cell_at(place);
    const double z10 = z_at(cell.i + 1, cell.j), z01 = z_at(cell.i, cell.j + 1);
    if (cell.x + cell.y <= 1.0) {
      const double z00 = z_at(cell.i, cell.j);
      return z00 + cell.x * (z10 - z00) + cell.y * (z01 - z00);
    }
    const double z11 = z_at(cell.i + 1, cell.j + 1);
    return z11 + (1.0 - cell.x) * (z01 - z11) + (1.0 - cell.y) * (z10 - z11);
  }
  /// The steepest rise between neighbouring samples of the cells at a place and round them.
  double slope(const Vector2d& place) const {
    const Cell cell = cell_at(place);
    const int last = world::kTileCells;
    double steepest_m = 0.0;
    for (int j = std::max(cell.j - 1, 0); j <= std::min(cell.j + 2, last); ++j)
      for (int i = std::max(cell.i - 1, 0); i <= std::min(cell.i + 2, last); ++i) {
        const double z = z_at(i, j);
        if (i < last) steepest_m = std::max(steepest_m, std::abs(z_at(i + 1, j) - z));
        if (j < last) steepest_m = std::max(steepest_m, std::abs(z_at(i, j + 1) - z));
      }
    return steepest_m / tile_.id.spacing_m();
  }
  /// All four samples around.
  bool is_water(const Vector2d& place) const {
    const Cell cell = cell_at(place);
    return is_water(cell.i, cell.j);
  }
  bool is_water(int cell_i, int cell_j) const {
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 2; ++i) {
        const world::Cover cover = tile_.cover[world::Tile::sample(cell_i + i, cell_j + j)];
        if (cover != world::Cover::Sea && cover != world::Cover::Lake &&
            cover != world::Cover::River)
          return false;
      }
    return true;
  }

 private:
  struct Cell {
    int i, j;
    double x, y;
  };
  double z_at(int i, int j) const {
    const double z = tile_.z_world(i, j);
    return is_bed_ ? z - tile_.water_depth_steps[world::Tile::sample(i, j)] * kHeightStep_m : z;
  }
  Cell cell_at(const Vector2d& place) const {
    const Vector2d at = (place - tile_.id.corner_world()) / tile_.id.spacing_m();
    const int i = std::clamp(static_cast<int>(std::floor(at.x())), 0, world::kTileCells - 1);
    const int j = std::clamp(static_cast<int>(std::floor(at.y())), 0, world::kTileCells - 1);
    return {i, j, at.x() - i, at.y() - j};
  }
  const world::Tile& tile_;
  bool is_bed_;
};

struct Box {
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
  Vector2d high = -low;
  void extend(const Vector2d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  Box widened(double by_m) const {
    return {low - Vector2d::Constant(by_m), high + Vector2d::Constant(by_m)};
  }
  bool contains(const Vector2d& p, double beside_m = 0.0) const {
    return (p.array() >= low.array() - beside_m).all() &&
           (p.array() <= high.array() + beside_m).all();
  }
};

/// Numbers of things by squares of a tile.
class Buckets {
 public:
  explicit Buckets(const world::TileId& id)
      : corner_(id.corner_world()),
        side_m_(id.side_m() / kBuckets),
        things_(static_cast<std::size_t>(kBuckets) * kBuckets) {}
  void add(const Box& box, std::size_t thing) {
    for (int j = index(box.low.y() - corner_.y()); j <= index(box.high.y() - corner_.y()); ++j)
      for (int i = index(box.low.x() - corner_.x()); i <= index(box.high.x() - corner_.x()); ++i)
        things_[at(i, j)].push_back(thing);
  }
  const std::vector<std::size_t>& near(const Vector2d& place) const {
    return things_[at(index(place.x() - corner_.x()), index(place.y() - corner_.y()))];
  }

 private:
  static std::size_t at(int i, int j) { return static_cast<std::size_t>(j * kBuckets + i); }
  int index(double from_corner_m) const {
    return static_cast<int>(std::clamp(std::floor(from_corner_m / side_m_), 0.0, kBuckets - 1.0));
  }
  Vector2d corner_;
  double side_m_;
  std::vector<std::vector<std::size_t>> things_;
};

bool is_hard(world::Paving paving) {
  return paving == world::Paving::Asphalt || paving == world::Paving::Concrete ||
         paving == world::Paving::Cobbles || paving == world::Paving::Ballast ||
         paving == world::Paving::Water;
}

Vector2d metres(const Eigen::Vector2i& steps) { return steps.cast<double>() * kHeightStep_m; }
double scale_of(const world::Instance& instance) { return instance.scale / 4096.0; }

class TileCheck {
 public:
  TileCheck(const world::Tile& tile, const world::WorldManifest& manifest,
            const std::vector<PrototypeSize>& sizes,
            const std::function<bool(double, double)>& is_judged, const Report& report,
            const Asked& asked)
      : tile_(tile),
        manifest_(manifest),
        sizes_(sizes),
        is_judged_(is_judged),
        report_(report),
        asked_(asked),
        ground_(tile, false),
        bed_(tile, true),
        solids_by_place_(tile.id),
        bodies_by_place_(tile.id),
        things_by_place_(tile.id),
        segments_by_place_(tile.id),
        areas_by_place_(tile.id) {}

  void run() {
    place_solids();
    place_things();
    place_paint();
    for (const world::Instance& instance : tile_.objects.instances) check_instance(instance);
    for (std::size_t i = 0; i < tile_.objects.solids.size(); ++i) check_solid(i);
    for (const world::Strip& strip : tile_.objects.strips) check_strip(strip);
    for (const world::Area& area : tile_.objects.areas) check_area(area);
  }

 private:
  struct Segment {
    Vector2d from, to;
    double half_width_m;
    std::size_t strip;
  };

  std::string_view kind_of(const world::Provenance& provenance) const {
    return provenance.layer < manifest_.layers.size()
               ? std::string_view(manifest_.layers[provenance.layer].kind)
               : std::string_view();
  }
  std::string where(const world::Provenance& provenance, const Vector2d& place) const {
    return fmt::format("tile {}: object {} of layer {} (feature {}) at {:.2f} E {:.2f} N",
                       tile_.id.name(), provenance.instance_id, kind_of(provenance),
                       provenance.feature, place.x(), place.y());
  }
  void judge(std::string_view kind, bool is_wrong, const world::Provenance& provenance,
             const Vector2d& place, const std::string& what) {
    asked_(kind, 1);
    if (is_wrong) report_(kind, where(provenance, place) + ": " + what);
  }

  void place_solids() {
    for (std::size_t i = 0; i < tile_.objects.solids.size(); ++i) {
      const world::Solid& solid = tile_.objects.solids[i];
      Box box;
      if (!solid.levels.empty())
        for (const Eigen::Vector3i& vertex : solid.levels.front().shape.vertices_steps)
          box.extend(metres((solid.origin_steps + vertex).head<2>()));
      boxes_.push_back(box);
      if (box.low.x() <= box.high.x()) solids_by_place_.add(box.widened(kSeam_m), i);
      // Coarser levels may be wider: blocks.
      Eigen::AlignedBox3d body;
      for (const world::ShapeLevel& level : solid.levels)
        for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
          body.extend(
              Eigen::Vector3d((solid.origin_steps + vertex).cast<double>() * kHeightStep_m));
      bodies_.push_back(body);
      if (body.isEmpty()) continue;
      Box plan;
      plan.extend(body.min().head<2>());
      plan.extend(body.max().head<2>());
      bodies_by_place_.add(plan.widened(kSeam_m), i);
    }
  }
  void place_things() {
    for (std::size_t i = 0; i < tile_.objects.instances.size(); ++i) {
      const world::Instance& instance = tile_.objects.instances[i];
      if (kind_of(instance.provenance) == "vegetation") continue;
      const Vector2d place = metres(instance.place_steps.head<2>());
      const Vector2d reach =
          Vector2d::Constant(sizes_[instance.prototype].side_m * scale_of(instance));
      Box box;
      box.extend(place - reach);
      box.extend(place + reach);
      things_by_place_.add(box, i);
    }
  }
  void place_paint() {
    for (std::size_t s = 0; s < tile_.objects.strips.size(); ++s) {
      const world::Strip& strip = tile_.objects.strips[s];
      if (!is_hard(strip.coating.paving)) continue;
      const double half_width_m = strip.half_width_steps * kHeightStep_m;
      for (std::size_t k = 0; k + 1 < strip.points_steps.size(); ++k) {
        const Segment segment{metres(strip.points_steps[k]), metres(strip.points_steps[k + 1]),
                              half_width_m, s};
        Box box;
        for (const Vector2d& end : {segment.from, segment.to}) {
          box.extend(end - Vector2d::Constant(half_width_m));
          box.extend(end + Vector2d::Constant(half_width_m));
        }
        segments_by_place_.add(box, segments_.size());
        segments_.push_back(segment);
      }
    }
    for (std::size_t a = 0; a < tile_.objects.areas.size(); ++a) {
      if (!is_hard(tile_.objects.areas[a].coating.paving)) continue;
      Box box;
      for (const auto& ring : tile_.objects.areas[a].rings_steps)
        for (const Eigen::Vector2i& point : ring) box.extend(metres(point));
      if (box.low.x() <= box.high.x()) areas_by_place_.add(box, a);
    }
  }

  bool is_painted(const Vector2d& place) const {
    for (const std::size_t i : segments_by_place_.near(place)) {
      const Segment& segment = segments_[i];
      const Vector2d along = segment.to - segment.from;
      const double t =
          std::clamp((place - segment.from).dot(along) / along.squaredNorm(), 0.0, 1.0);
      if ((place - segment.from - t * along).norm() < segment.half_width_m) return true;
    }
    for (const std::size_t i : areas_by_place_.near(place)) {
      bool is_in = false;
      for (const auto& ring : tile_.objects.areas[i].rings_steps)
        for (std::size_t k = 0; k < ring.size(); ++k) {
          const Vector2d a = metres(ring[k]), b = metres(ring[(k + 1) % ring.size()]);
          if ((a.y() > place.y()) != (b.y() > place.y()) &&
              place.x() < a.x() + (place.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
            is_in = !is_in;
        }
      if (is_in) return true;
    }
    return false;
  }

  PlacedShape finest(std::size_t index) const {
    const world::Solid& solid = tile_.objects.solids[index];
    return {solid.origin_steps, &solid.levels.front().shape};
  }
  /// Whether a solid is there, on which things may stand.
  bool has_solid(const Vector2d& place) const {
    const auto& near = solids_by_place_.near(place);
    return std::any_of(near.begin(), near.end(),
                       [&](std::size_t i) { return boxes_[i].contains(place, kSeam_m); });
  }
  /// Whether a point lies in another solid as this tile shows it, or upon or beside it but for a seam: walls of neighbours
  /// stand back from the line that they share.
  bool meets_other(const Eigen::Vector3d& point_world, std::size_t but) const {
    const auto& near = bodies_by_place_.near(point_world.head<2>());
    return std::any_of(near.begin(), near.end(), [&](std::size_t i) {
      if (i == but || bodies_[i].squaredExteriorDistance(point_world) > kSeam_m * kSeam_m)
        return false;
      const world::Solid& other = tile_.objects.solids[i];
      const world::Shape* shape = finest_shown(other);
      return shape != nullptr && meets({other.origin_steps, shape}, point_world, kSeam_m);
    });
  }
  /// Whether a body's middle lies upon others or between places of its bottom that do.
  bool is_held(const PlacedShape& body, std::size_t index) const {
    const Bottom bottom = bottom_of(body, kFoot_m);
    if (!bottom.middle_world) return false;
    if (meets_other(*bottom.middle_world, index)) return true;
    std::vector<Vector2d> held;
    for (const Eigen::Vector3d& place : bottom.places_world)
      if (meets_other(place, index)) held.push_back(place.head<2>());
    return is_between(bottom.middle_world->head<2>(), held);
  }

  /// Whether something stands upon another thing: what carries it is judged by itself.
  bool has_thing_below(const world::Instance& instance) const {
    const Vector2d place = metres(instance.place_steps.head<2>());
    const double foot_z = instance.place_steps.z() * kHeightStep_m;
    const auto& near = things_by_place_.near(place);
    return std::any_of(near.begin(), near.end(), [&](std::size_t i) {
      const world::Instance& below = tile_.objects.instances[i];
      const double low_z = below.place_steps.z() * kHeightStep_m;
      const double top_z = low_z + sizes_[below.prototype].top_m * scale_of(below);
      return low_z < foot_z && std::abs(top_z - foot_z) <= kSeam_m &&
             (metres(below.place_steps.head<2>()) - place).norm() <=
                 sizes_[below.prototype].side_m * scale_of(below);
    });
  }

  void check_instance(const world::Instance& instance) {
    const Vector2d place = metres(instance.place_steps.head<2>());
    if (!is_judged_(place.x(), place.y())) return;
    const double z = instance.place_steps.z() * kHeightStep_m;
    const PrototypeSize& size = sizes_[instance.prototype];
    const bool is_plant = kind_of(instance.provenance) == "vegetation";
    const bool is_in_water = is_plant && ground_.is_water(place);
    const Ground& below = is_in_water && (size.is_seagrass || size.is_stone) ? bed_ : ground_;
    const double above_m = z - below.z_world(place);
    judge("floating_instance",
          above_m > tolerance_m(tile_.id, below.slope(place)) &&
              (is_plant || (!has_solid(place) && !has_thing_below(instance))),
          instance.provenance, place, fmt::format("{:.2f} m above the ground", above_m));
    if (!is_plant) return;
    judge("plant_in_water", is_in_water && !size.is_seagrass && !size.is_stone, instance.provenance,
          place, "it grows in water");
    if (size.is_seagrass)
      judge("seagrass_out_of_water",
            !is_in_water || z + size.top_m * scale_of(instance) > ground_.z_world(place),
            instance.provenance, place,
            is_in_water ? "its blades reach out of the water" : "it grows on land");
    // Coarse tiles hold pieces of forest, not plants.
    constexpr int kCoarsestPlants = 2;
    if (tile_.id.level > kCoarsestPlants) return;
    judge("plant_on_paint", is_painted(place), instance.provenance, place, "it grows on a road");
    const auto& near = solids_by_place_.near(place);
    constexpr double kAboveFoot_m = 0.5;
    judge("plant_in_wall",
          std::any_of(near.begin(), near.end(),
                      [&](std::size_t i) {
                        return boxes_[i].contains(place) &&
                               contains(finest(i), {place.x(), place.y(), z + kAboveFoot_m});
                      }),
          instance.provenance, place, "it grows in a solid");
  }

  /// The finest shape of a solid that is ever shown over this tile. The tile that holds its place decides, and tiles
  /// of a cut that meet along a side differ by a level at most, those that meet at a corner by two.
  const world::Shape* finest_shown(const world::Solid& solid) const {
    const world::TileId own = world::tile_at(tile_.id.level, solid.place_m.x(), solid.place_m.y());
    const int num_apart = std::abs(own.x - tile_.id.x) + std::abs(own.y - tile_.id.y);
    return world::shape_at(solid.levels, tile_.id.level - num_apart);
  }

  /// The foot of a building stands in the ground or upon others, or these hold the building.
  void check_solid(std::size_t index) {
    const world::Solid& solid = tile_.objects.solids[index];
    if (kind_of(solid.provenance) != "buildings" || solid.levels.empty()) return;
    const PlacedShape body{solid.origin_steps, finest_shown(solid)};
    if (body.shape == nullptr) return;
    std::vector<Eigen::Vector3d> vertices_world;
    for (const Eigen::Vector3i& vertex : body.shape->vertices_steps)
      vertices_world.push_back(body.vertex_world(vertex));
    double lowest_z = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& vertex : vertices_world) lowest_z = std::min(lowest_z, vertex.z());
    for (const Eigen::Vector3d& vertex : vertices_world) {
      const Vector2d place = vertex.head<2>();
      if (vertex.z() > lowest_z + kFoot_m || !is_judged_(place.x(), place.y())) continue;
      const double above_m = vertex.z() - ground_.z_world(place);
      const bool is_high =
          above_m > tolerance_m(tile_.id, ground_.slope(place)) && !meets_other(vertex, index);
      const bool is_held_up = is_high && is_held(body, index);
      judge("floating_building", is_high && !is_held_up, solid.provenance, place,
            fmt::format("its foot is {:.2f} m above the ground", above_m));
      if (is_high) return;
    }
  }

  void check_strip(const world::Strip& strip) {
    if (strip.coating.paving == world::Paving::Water) return;
    const world::Provenance provenance{
        .instance_id = 0, .layer = strip.coating.layer, .feature = strip.coating.feature};
    for (const Eigen::Vector2i& point : strip.points_steps) {
      const Vector2d place = metres(point);
      if (!is_judged_(place.x(), place.y())) continue;
      const bool is_wrong = ground_.is_water(place);
      judge("paint_under_water", is_wrong, provenance, place, "it is painted where water is");
      if (is_wrong) return;
    }
  }

  /// Middles of the cells of water in it. Piers stand in water.
  void check_area(const world::Area& area) {
    if (area.coating.paving == world::Paving::Water ||
        area.coating.semantic_class == core::SemanticClass::Pier)
      return;
    const world::Provenance provenance{
        .instance_id = 0, .layer = area.coating.layer, .feature = area.coating.feature};
    const Vector2d corner = tile_.id.corner_world();
    const double spacing_m = tile_.id.spacing_m();
    Box box;
    for (const auto& ring : area.rings_steps)
      for (const Eigen::Vector2i& point : ring) box.extend((metres(point) - corner) / spacing_m);
    std::vector<double> crossings;  // of a row of cells with the area's sides, in cells
    for (int j = std::max(static_cast<int>(std::floor(box.low.y())), 0);
         j < std::min<double>(box.high.y(), world::kTileCells); ++j) {
      const double y = j + 0.5;
      crossings.clear();
      for (const auto& ring : area.rings_steps)
        for (std::size_t k = 0; k < ring.size(); ++k) {
          const Vector2d a = (metres(ring[k]) - corner) / spacing_m;
          const Vector2d b = (metres(ring[(k + 1) % ring.size()]) - corner) / spacing_m;
          if ((a.y() > y) != (b.y() > y))
            crossings.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
        }
      std::sort(crossings.begin(), crossings.end());
      for (std::size_t k = 0; k + 1 < crossings.size(); k += 2)
        for (int i = std::max(static_cast<int>(std::ceil(crossings[k] - 0.5)), 0);
             i < world::kTileCells && i + 0.5 < crossings[k + 1]; ++i) {
          const Vector2d place = corner + spacing_m * Vector2d(i + 0.5, y);
          if (!is_judged_(place.x(), place.y())) continue;
          const bool is_wrong = ground_.is_water(i, j);
          judge("paint_under_water", is_wrong, provenance, place, "an area is painted on water");
          if (is_wrong) return;
        }
    }
  }

  const world::Tile& tile_;
  const world::WorldManifest& manifest_;
  const std::vector<PrototypeSize>& sizes_;
  const std::function<bool(double, double)>& is_judged_;
  const Report& report_;
  const Asked& asked_;
  Ground ground_;
  Ground bed_;
  std::vector<Box> boxes_;                   ///< of the solids' finest shapes
  std::vector<Eigen::AlignedBox3d> bodies_;  ///< of the solids, over all of their levels
  Buckets solids_by_place_, bodies_by_place_, things_by_place_, segments_by_place_, areas_by_place_;
  std::vector<Segment> segments_;
};

}  // namespace

PrototypeSize size_of(const world::Prototype& prototype) {
  PrototypeSize size;
  size.is_seagrass = prototype.name.starts_with("seagrass");
  bool has_stone = false, has_other = false;
  for (const world::ShapeLevel& level : prototype.levels)
    for (const world::Finish& finish : level.shape.finishes)
      (finish.semantic_class == core::SemanticClass::Stone ? has_stone : has_other) = true;
  size.is_stone = has_stone && !has_other;
  for (const world::ShapeLevel& level : prototype.levels)
    for (const Eigen::Vector3i& vertex : level.shape.vertices_steps) {
      size.top_m = std::max(size.top_m, vertex.z() * kHeightStep_m);
      size.side_m = std::max(size.side_m, metres(vertex.head<2>()).norm());
    }
  return size;
}

void check_ground(const world::Tile& tile, const world::WorldManifest& manifest,
                  const std::vector<PrototypeSize>& sizes,
                  const std::function<bool(double, double)>& is_judged, const Report& report,
                  const Asked& asked) {
  TileCheck(tile, manifest, sizes, is_judged, report, asked).run();
}

}  // namespace terracast::world_check
