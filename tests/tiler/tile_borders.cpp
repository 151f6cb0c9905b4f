#include "tests/tiler/tile_borders.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <string_view>
#include <vector>

#include "world/tile_id.h"

namespace terracast::test {
namespace {

using Box = Eigen::AlignedBox2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using world::kHeightStep_m;
using world::Tile;
using world::TileId;

Vector2d metres(const Eigen::Vector2i& steps) { return kHeightStep_m * steps.cast<double>(); }

/// Lines of a thing in the plane: edges of its triangles, of its rings, a strip's own.
using Lines = std::vector<std::array<Vector2d, 2>>;

void add_ring(const std::vector<Vector2d>& corners, Lines& lines) {
  for (std::size_t i = 0; i < corners.size(); ++i)
    lines.push_back({corners[i], corners[(i + 1) % corners.size()]});
}

template <class PlaceOfVertex>
Lines lines_of(const world::Shape* shape, const PlaceOfVertex& place_of) {
  Lines lines;
  if (shape == nullptr) return lines;
  for (const world::Shape::Triangle& triangle : shape->triangles)
    add_ring({place_of(shape->vertices_steps[triangle.corners[0]]),
              place_of(shape->vertices_steps[triangle.corners[1]]),
              place_of(shape->vertices_steps[triangle.corners[2]])},
             lines);
  return lines;
}

Lines lines_of(const world::Solid& solid, int level) {
  return lines_of(world::shape_at(solid.levels, level), [&](const Eigen::Vector3i& vertex) {
    return metres((solid.origin_steps + vertex).head<2>());
  });
}

Lines lines_of(const world::Instance& instance, const world::Prototype& prototype, int level) {
  if (level > instance.coarsest_level) return {};
  const Eigen::Rotation2Dd turn(instance.heading * 2.0 * std::numbers::pi / 65536.0);
  return lines_of(world::shape_at(prototype.levels, level), [&](const Eigen::Vector3i& vertex) {
    return Vector2d(metres(instance.place_steps.head<2>()) +
                    instance.scale / 4096.0 * (turn * metres(vertex.head<2>())));
  });
}

/// How far a prototype of scale 1 reaches from its foot.
double reach_of(const world::Prototype& prototype) {
  double largest = 0.0;
  for (const world::ShapeLevel& level : prototype.levels)
    for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
      largest = std::max(largest, vertex.cast<double>().norm());
  return largest * kHeightStep_m;
}

Lines lines_of(const world::Strip& strip) {
  Lines lines;
  for (std::size_t i = 0; i + 1 < strip.points_steps.size(); ++i)
    lines.push_back({metres(strip.points_steps[i]), metres(strip.points_steps[i + 1])});
  return lines;
}

Lines lines_of(const world::Area& area) {
  Lines lines;
  for (const auto& ring : area.rings_steps) {
    std::vector<Vector2d> corners;
    for (const Eigen::Vector2i& point : ring) corners.push_back(metres(point));
    add_ring(corners, lines);
  }
  return lines;
}

Box box_of(const Lines& lines) {
  Box box;
  for (const auto& line : lines) box.extend(line[0]).extend(line[1]);
  return box;
}

/// Whether any of a line lies in a box (Liang and Barsky 1984).
bool reaches_into(const std::array<Vector2d, 2>& line, const Box& box) {
  double from = 0.0, to = 1.0;
  const Vector2d step = line[1] - line[0];
  for (int axis = 0; axis < 2; ++axis) {
    const double low = box.min()[axis] - line[0][axis];
    const double high = box.max()[axis] - line[0][axis];
    if (step[axis] == 0.0) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    from = std::max(from, std::min(low / step[axis], high / step[axis]));
    to = std::min(to, std::max(low / step[axis], high / step[axis]));
  }
  return from <= to;
}

template <class Thing>
bool has(const std::vector<Thing>& things, const Thing& wanted) {
  return std::find(things.begin(), things.end(), wanted) != things.end();
}

/// Whether a place lies within an odd number of rings.
bool holds(const world::Area& area, const Vector2d& at) {
  bool is_in = false;
  for (const auto& line : lines_of(area))
    if ((line[0].y() > at.y()) != (line[1].y() > at.y()) &&
        at.x() < line[0].x() + (at.y() - line[0].y()) / (line[1].y() - line[0].y()) *
                                   (line[1].x() - line[0].x()))
      is_in = !is_in;
  return is_in;
}

/// Areas end at the water that a tile shows; on its dry ground they are all there.
bool has_dry_part(const Tile& tile, const world::Area& wanted) {
  const double spacing_m = tile.id.spacing_m();
  for (int j = 0; j < world::kTileCells; ++j)
    for (int i = 0; i < world::kTileCells; ++i) {
      const Vector2d at = tile.id.corner_world() + spacing_m * Vector2d(i + 0.5, j + 0.5);
      bool is_dry = true;
      for (const int north : {0, 1})
        for (const int east : {0, 1})
          is_dry = is_dry && !world::is_water(tile.cover[Tile::sample(i + east, j + north)]);
      if (!is_dry || !holds(wanted, at)) continue;
      if (std::none_of(tile.objects.areas.begin(), tile.objects.areas.end(),
                       [&](const world::Area& area) {
                         return area.coating == wanted.coating && holds(area, at);
                       }))
        return false;
    }
  return true;
}

/// Of solids, what tiles of this level and coarser ones show.
bool has_alike(const std::vector<world::Solid>& solids, const world::Solid& wanted, int level) {
  for (const world::Solid& solid : solids)
    if (solid.provenance == wanted.provenance)
      return solid.place_m == wanted.place_m && solid.origin_steps == wanted.origin_steps &&
             *world::shape_at(solid.levels, level) == *world::shape_at(wanted.levels, level);
  return false;
}

class Borders {
 public:
  explicit Borders(const world::TileStore& store) : store_(store) {
    for (std::size_t row = 0; row < store.manifest().prototypes.size(); ++row) {
      prototypes_.push_back(store.load_prototype(row));
      reaches_m_.push_back(reach_of(prototypes_.back()));
    }
    for (const world::TileInfo& info : store.manifest().tiles)
      tiles_.emplace(info.id, store.load(info.id));
  }

  Crossings look() {
    for (const auto& [id, tile] : tiles_) look_at(id, tile.objects);
    return std::move(crossings_);
  }

 private:
  void look_at(const TileId& id, const world::TileObjects& objects) {
    std::set<std::uint32_t> ids;
    const auto once = [&](const world::Provenance& provenance, const Vector2d& place_m) {
      EXPECT_TRUE(ids.insert(provenance.instance_id).second)
          << "tile " << id.name() << " holds object " << provenance.instance_id << " twice";
      const auto [known, is_new] = places_m_.try_emplace(provenance.instance_id, place_m);
      EXPECT_EQ(known->second, place_m) << "two objects have the id " << provenance.instance_id;
    };
    for (const world::Solid& solid : objects.solids) {
      once(solid.provenance, solid.place_m.cast<double>());
      const Lines lines = lines_of(solid, id.level);
      over_borders(
          id, box_of(lines), 0.0, [&] { return lines; }, solid.provenance.layer, "solids",
          [&](const Tile& there) { return has_alike(there.objects.solids, solid, id.level); });
    }
    for (const world::Instance& instance : objects.instances) {
      const Vector2d place_m = metres(instance.place_steps.head<2>());
      once(instance.provenance, place_m);
      const double reach_m = reaches_m_[instance.prototype] * instance.scale / 4096.0;
      const Vector2d reach = Vector2d::Constant(reach_m);
      // It stands along up, which leans away from z by the distance from the origin over the Earth's radius.
      constexpr double kLeastEarthRadius_m = 6.33e6;
      over_borders(
          id, Box(place_m - reach, place_m + reach), reach_m * place_m.norm() / kLeastEarthRadius_m,
          [&] { return lines_of(instance, prototypes_[instance.prototype], id.level); },
          instance.provenance.layer, "instances",
          [&](const Tile& there) { return has(there.objects.instances, instance); });
    }
    for (const world::Strip& strip : objects.strips) {
      const Lines lines = lines_of(strip);
      over_borders(
          id, box_of(lines), 0.0, [&] { return lines; }, strip.coating.layer, "strips",
          [&](const Tile& there) { return has(there.objects.strips, strip); });
    }
    for (const world::Area& area : objects.areas) {
      const Lines lines = lines_of(area);
      over_borders(
          id, box_of(lines), 0.0, [&] { return lines; }, area.coating.layer, "areas",
          [&](const Tile& there) {
            return has(there.objects.areas, area) || has_dry_part(there, area);
          });
    }
  }

  /// box       of all of it, or larger
  /// slack_m   by which its lines may be wrong
  template <class LinesOfIt, class IsThere>
  void over_borders(const TileId& id, const Box& box, double slack_m, const LinesOfIt& lines_of_it,
                    std::uint8_t layer, std::string_view what, const IsThere& is_there) {
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const auto neighbour = tiles_.find(id.neighbour(dx, dy));
        if ((dx == 0 && dy == 0) || neighbour == tiles_.end()) continue;
        const Vector2d low = neighbour->first.corner_world();
        const Vector2d inset = Vector2d::Constant(kHeightStep_m + slack_m);
        const Box square(low + inset, low + Vector2d::Constant(id.side_m()) - inset);
        if (!box.intersects(square)) continue;
        const Lines lines = lines_of_it();
        if (std::none_of(lines.begin(), lines.end(),
                         [&](const auto& line) { return reaches_into(line, square); }))
          continue;
        const std::string name = fmt::format("{} {}", store_.manifest().layers[layer].kind, what);
        ++crossings_[name];
        if (!is_there(neighbour->second) && ++num_missing_ < 20)
          ADD_FAILURE() << name << ": one of tile " << id.name() << " reaches into "
                        << neighbour->first.name() << ", which has not the same";
      }
  }

  const world::TileStore& store_;
  std::vector<world::Prototype> prototypes_;
  std::vector<double> reaches_m_;  ///< of the prototypes
  std::map<TileId, Tile> tiles_;
  std::map<std::uint32_t, Vector2d> places_m_;
  Crossings crossings_;
  int num_missing_ = 0;
};

}  // namespace

Crossings expect_whole_over_borders(const world::TileStore& store) { return Borders(store).look(); }

}  // namespace terracast::test
