#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/parallel.h"
#include "core/toml_reader.h"
#include "tests/tiler/raster_files.h"
#include "tiler/instance_ids.h"
#include "tiler/layer_stack.h"
#include "tiler/tile_builder.h"
#include "world/objects_file.h"
#include "world/tile_id.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2d;
using world::Cover;
using world::Instance;
using world::TileId;

tiler::LayerOptions layer_of(const std::string& text) {
  tiler::LayerOptions options;
  core::TomlDocument::parse("kind = \"vegetation\"\n" + text, "layer.toml").read(options);
  return options;
}

/// Ground whose cover is a function of place, and where things stand that leave no room.
struct Land final : tiler::LayerSite {
  std::function<Cover(const Vector2d&)> cover_at = [](const Vector2d&) { return Cover::Forest; };
  /// Distance to the nearest of what others hold; below 0 within.
  std::function<double(const Vector2d&)> room_m = [](const Vector2d&) { return 1e9; };
  std::function<double(const Vector2d&)> z_at = [](const Vector2d& place) {
    return 300.0 + 0.02 * place.x();
  };
  bool has_walls = false;

  double ground_z_world(const Vector2d& place) const override { return z_at(place); }
  bool has_walls_near(const Vector2d&, double) const override { return has_walls; }
  Cover cover(const Vector2d& place) const override { return cover_at(place); }
  bool is_free(const Vector2d& place, double radius_m) const override {
    return room_m(place) >= radius_m;
  }
};

/// A layer on a plane.
struct Planted {
  explicit Planted(const std::string& text = "", double size_m = 16384.0, double ground_m = 300.0,
                   std::int64_t seed = 1) {
    tiler::WorldOptions options = world_of("plane", size_m);
    options.elevation[0].height_m = ground_m;
    surface = prepare(options);
    const core::Log log("tile", core::LogLevel::Off);
    tiler::InstanceIds ids;
    layer = layer_of(text).kind_options().make({.frame = surface->frame(),
                                                .size_m = size_m,
                                                .seed = static_cast<std::uint64_t>(seed),
                                                .surface = *surface,
                                                .earlier = {},
                                                .ids = ids,
                                                .country = {},
                                                .licence = {},
                                                .accuracy = {},
                                                .context = {.log = log, .num_threads = 0}});
  }

  std::vector<Instance> on(const TileId& id, const Land& land) const {
    world::TileObjects objects;
    layer->add_objects(id, land, objects);
    EXPECT_TRUE(objects.solids.empty() && objects.strips.empty() && objects.areas.empty());
    return objects.instances;
  }
  /// What is shown of those that stand on a tile, by id.
  std::map<std::uint32_t, Instance> shown_on(const TileId& id, const Land& land) const {
    std::map<std::uint32_t, Instance> shown;
    for (const Instance& instance : on(id, land)) {
      const Vector2d at = place_of(instance);
      if (world::tile_at(id.level, at.x(), at.y()) != id || shape_of(instance, id.level) == nullptr)
        continue;
      EXPECT_TRUE(shown.emplace(instance.provenance.instance_id, instance).second);
    }
    return shown;
  }
  /// Null: nothing is shown.
  const world::Shape* shape_of(const Instance& instance, int level) const {
    if (level > instance.coarsest_level) return nullptr;
    const world::Shape* shape =
        world::shape_at(layer->prototypes()[instance.prototype].levels, level);
    return shape == nullptr || shape->triangles.empty() ? nullptr : shape;
  }
  const std::string& name_of(const Instance& instance) const {
    return layer->prototypes()[instance.prototype].name;
  }
  bool is_a(const Instance& instance, std::string_view words) const {
    return name_of(instance).find(words) != std::string::npos;
  }
  bool is_tree(const Instance& instance) const {
    return !is_a(instance, "forest") &&
           (is_a(instance, "oak") || is_a(instance, "birch") || is_a(instance, "poplar") ||
            is_a(instance, "spruce") || is_a(instance, "pine_") || is_a(instance, "palm") ||
            is_a(instance, "dead")) &&
           !is_a(instance, "mountain");
  }
  /// How far its shapes reach from its place, in the plane.
  double reach_m(const Instance& instance) const {
    if (reaches_m.empty())
      for (const world::Prototype& prototype : layer->prototypes()) {
        reaches_m.push_back(0.0);
        for (const world::ShapeLevel& level : prototype.levels)
          for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
            reaches_m.back() = std::max(
                reaches_m.back(), vertex.head<2>().cast<double>().norm() * world::kHeightStep_m);
      }
    return reaches_m[instance.prototype] * instance.scale / 4096.0;
  }
  double height_m(const Instance& instance) const {
    int highest = 0;
    for (const world::ShapeLevel& level : layer->prototypes()[instance.prototype].levels)
      for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
        highest = std::max(highest, vertex.z());
    return highest * world::kHeightStep_m * instance.scale / 4096.0;
  }
  static Vector2d place_of(const Instance& instance) {
    return instance.place_steps.head<2>().cast<double>() * world::kHeightStep_m;
  }

  std::shared_ptr<const tiler::WorldSurface> surface;
  std::unique_ptr<tiler::Layer> layer;
  mutable std::vector<double> reaches_m;
};

/// The layer without options; made once for all tests.
const Planted& planted() {
  static const Planted layer;
  return layer;
}

/// A road, a lake and houses.
Land with_things() {
  Land land;
  land.room_m = [](const Vector2d& at) {
    const double road = std::abs(at.y() - 0.3 * at.x() - 70.0) / std::hypot(1.0, 0.3) - 4.0;
    const double lake = (at - Vector2d(180.0, 60.0)).norm() - 35.0;
    const Vector2d in_block = at.array() - 48.0 * (at.array() / 48.0).floor() - 24.0;
    const Vector2d out_of_house = (in_block.cwiseAbs().array() - 5.0).cwiseMax(0.0);
    return std::min({road, lake, out_of_house.norm()});
  };
  return land;
}

TEST(Vegetation, PrototypesAreSaneAndSurviveTheirFiles) {
  for (const world::Prototype& prototype : planted().layer->prototypes()) {
    SCOPED_TRACE(prototype.name);
    std::size_t num_degenerate = 0;
    for (const world::ShapeLevel& level : prototype.levels)
      for (const world::Shape::Triangle& triangle : level.shape.triangles) {
        const auto at = [&](std::size_t k) {
          return Eigen::Vector3d(level.shape.vertices_steps.at(triangle.corners[k]).cast<double>());
        };
        if ((at(1) - at(0)).cross(at(2) - at(0)).norm() == 0.0) ++num_degenerate;
      }
    EXPECT_EQ(num_degenerate, 0U);
    EXPECT_EQ(world::decode_prototype(world::encode_prototype(prototype), "plant"), prototype);
  }
}

TEST(Vegetation, NothingStandsWhereThereIsNoRoom) {
  const Planted& layer = planted();
  Land land = with_things();
  for (const Cover cover :
       {Cover::Forest, Cover::BuiltUp, Cover::Shrubs, Cover::Wetland, Cover::Crops, Cover::Grass}) {
    land.cover_at = [cover](const Vector2d&) { return cover; };
    for (const TileId id : {TileId{-1, 0, 0}, TileId{0, 0, 0}, TileId{3, 0, 0}}) {
      if (id.level == 3 && cover != Cover::Forest) continue;
      SCOPED_TRACE(fmt::format("cover {} tile {}", static_cast<int>(cover), id.name()));
      const std::vector<Instance> instances = layer.on(id, land);
      EXPECT_FALSE(instances.empty() && id.level < 2);
      std::size_t num_wrong = 0;
      for (const Instance& instance : instances) {
        // Places are rounded to steps, and scales to 1/4096.
        const double reach_m = layer.is_a(instance, "corn") || layer.is_a(instance, "wheat") ||
                                       layer.is_a(instance, "vine")
                                   ? 2.8
                                   : layer.reach_m(instance);
        if (land.room_m(Planted::place_of(instance)) < reach_m - 0.01) ++num_wrong;
      }
      EXPECT_EQ(num_wrong, 0U) << "of " << instances.size();
    }
  }
}

TEST(Vegetation, NothingGrowsInWaterOnSnowOrBeyondTheSquare) {
  const Planted small("", 1024.0);
  Land land;
  for (const Cover cover : {Cover::Sea, Cover::Lake, Cover::River, Cover::Snow, Cover::Outside}) {
    land.cover_at = [cover](const Vector2d&) { return cover; };
    for (const int level : {-2, 0, 2, 4}) EXPECT_TRUE(small.on({level, 0, 0}, land).empty());
  }
  land.cover_at = [](const Vector2d&) { return Cover::Forest; };
  for (const TileId id : {TileId{0, 1, 1}, TileId{0, 2, 0}, TileId{2, -1, 0}, TileId{3, 0, 0}})
    for (const Instance& instance : small.on(id, land))
      EXPECT_LT(Planted::place_of(instance).cwiseAbs().maxCoeff(), 512.0);
  EXPECT_TRUE(small.on({0, 3, 0}, land).empty());
}

TEST(Vegetation, TilesWhoseSamplesMissARockInTheSeaShowNothingOnIt) {
  // Seen in November 2026, in Archipelago rocks 12 m wide, each between the samples of tiles of 16 m; in Monaco one
  // between those of a tile of 4 m.
  struct Rocks {
    double apart_m;
    double half_m;
    int missing_level;
  };
  for (const Rocks& rocks : {Rocks{16.0, 6.0, 4}, Rocks{4.0, 1.8, 2}}) {
    SCOPED_TRACE(rocks.apart_m);
    const auto inside_m = [&](const Vector2d& place) {
      const Vector2d in_cell =
          place - rocks.apart_m * (place / rocks.apart_m).array().floor().matrix();
      return rocks.half_m - (in_cell.array() - 0.5 * rocks.apart_m).abs().maxCoeff();
    };
    Land land;
    land.cover_at = [&](const Vector2d& place) {
      return inside_m(place) > 0.0 ? Cover::Forest : Cover::Sea;
    };
    land.room_m = inside_m;
    const Planted layer("", 1024.0);
    for (const int finer : {1, 2})
      EXPECT_GT(layer.shown_on({rocks.missing_level - finer, 0, 0}, land).size(), 10U) << finer;
    for (const int x : {-1, 0})
      EXPECT_TRUE(layer.shown_on({rocks.missing_level, x, 0}, land).empty());
  }
}

TEST(Vegetation, TilesShowNothingInTheAirBesideWalls) {
  // Seen in Alpine and Andorra in November 2026. Terraces 20 m high, whose walls stand 2 m beyond samples of all tiles.
  const auto terrace_z = [](double x) { return 300.0 + 20.0 * std::floor((x - 2.0) / 64.0); };
  Land land;
  land.z_at = [&](const Vector2d& place) { return terrace_z(place.x()); };
  land.has_walls = true;
  const Planted layer("", 2048.0);
  for (const int level : {0, 1, 2, 3, 4}) {
    std::size_t num_beside = 0;
    const double spacing_m = std::exp2(level);
    for (const auto& [id, instance] : layer.shown_on({level, 0, 0}, land)) {
      const double x = Planted::place_of(instance).x();
      const double z = instance.place_steps.z() * world::kHeightStep_m;
      EXPECT_NEAR(z, terrace_z(x), world::kHeightStep_m);
      // The ground does not change towards the north: what a tile shows goes straight from sample to sample.
      const double west = spacing_m * std::floor(x / spacing_m);
      const double share = (x - west) / spacing_m;
      const double shown_z = (1.0 - share) * terrace_z(west) + share * terrace_z(west + spacing_m);
      // What world check allows where slopes are below 1, and more than a step less.
      EXPECT_LE(z - shown_z, 0.25 + 0.3 * spacing_m)
          << layer.name_of(instance) << " on level " << level << " at " << x;
      if (std::abs(std::remainder(x - 2.0, 64.0)) < spacing_m) ++num_beside;
    }
    if (level <= 2) {
      EXPECT_GT(num_beside, 10U);  // below the walls, and on them where all is shown
    }
  }
}

TEST(Vegetation, TreesKeepTheirDistanceAndAreAsManyAsInAForest) {
  const Planted& layer = planted();
  const Land land;
  std::vector<Vector2d> stems;
  for (const auto& [id, instance] : layer.shown_on({0, 0, 0}, land))
    if (layer.is_tree(instance)) stems.push_back(Planted::place_of(instance));
  double least_m = 1e9;
  for (std::size_t i = 0; i < stems.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) least_m = std::min(least_m, (stems[i] - stems[j]).norm());
  EXPECT_GE(least_m, 3.5 - 0.002);  // places are rounded to steps
  // 6.55 ha; European forests have some 200 to 800 stems a hectare.
  const double per_hectare = static_cast<double>(stems.size()) / 6.5536;
  EXPECT_GT(per_hectare, 200.0);
  EXPECT_LT(per_hectare, 800.0);
}

TEST(Vegetation, TilesOfAnySizeInAnyOrderHoldTheSame) {
  const Planted& layer = planted();
  Land land = with_things();
  land.cover_at = [](const Vector2d& at) {
    const auto cell =
        static_cast<int>(std::floor(at.x() / 90.0) + 7.0 * std::floor(at.y() / 110.0));
    constexpr Cover kCovers[] = {Cover::Forest, Cover::Crops,   Cover::Grass,   Cover::Shrubs,
                                 Cover::Land,   Cover::BuiltUp, Cover::Wetland, Cover::Bare};
    return kCovers[((cell % 8) + 8) % 8];
  };
  // One tile of level 2 against the 16 of level 0 in an order of their own, and those from threads.
  const auto whole = layer.shown_on({2, -1, -1}, land);
  ASSERT_GT(whole.size(), 5000U);
  std::vector<std::map<std::uint32_t, Instance>> parts(16);
  core::parallel_for(16, [&](std::int64_t i) {
    const int k = static_cast<int>((i * 7 + 3) % 16);
    parts[static_cast<std::size_t>(k)] = layer.shown_on({0, -4 + k % 4, -4 + k / 4}, land);
  });
  std::map<std::uint32_t, Instance> all;
  std::size_t num_parts = 0;
  for (const auto& part : parts) {
    num_parts += part.size();
    all.insert(part.begin(), part.end());
  }
  EXPECT_EQ(all.size(), num_parts);  // each id once
  std::size_t num_found = 0;
  for (const auto& [id, instance] : whole) {
    ASSERT_TRUE(all.contains(id));
    EXPECT_EQ(all.at(id), instance);
    ++num_found;
  }
  // What level 2 does not show is too small for it.
  for (const auto& [id, instance] : all)
    if (!whole.contains(id)) {
      EXPECT_EQ(layer.shape_of(instance, 2), nullptr) << layer.name_of(instance);
    }
  EXPECT_GT(num_found, 5000U);
  EXPECT_EQ(layer.on({0, -2, -2}, land), layer.on({0, -2, -2}, land));
}

TEST(Vegetation, NeighboursHoldWhatReachesIntoThem) {
  const Planted& layer = planted();
  const Land land;
  // Whatever the levels of two tiles beside each other: a crown over the border is in both.
  for (const auto& [near, beside] :
       std::vector<std::pair<TileId, TileId>>{{{0, 0, 0}, {0, 1, 0}},
                                              {{0, 1, 0}, {1, 1, 0}},
                                              {{2, 1, 0}, {3, 1, 0}},
                                              {{3, 0, 0}, {2, 2, 1}},
                                              {{3, 1, 0}, {4, 1, 0}},
                                              {{5, -1, 0}, {4, 0, 0}}}) {
    SCOPED_TRACE(near.name() + " beside " + beside.name());
    std::map<std::uint32_t, Instance> held;
    for (const Instance& instance : layer.on(near, land))
      held.emplace(instance.provenance.instance_id, instance);
    std::size_t num_reaching = 0;
    for (const auto& [id, instance] : layer.shown_on(beside, land)) {
      const Vector2d at = Planted::place_of(instance);
      const Vector2d corner = near.corner_world();
      const Vector2d outside =
          (corner - at).cwiseMax(at - corner - Vector2d::Constant(near.side_m())).cwiseMax(0.0);
      if (outside.norm() >= layer.reach_m(instance)) continue;
      ++num_reaching;
      ASSERT_TRUE(held.contains(id)) << layer.name_of(instance) << " at " << at.transpose();
      EXPECT_EQ(held.at(id), instance);
    }
    EXPECT_GT(num_reaching, 10U);
  }
}

/// Share of a square of 256 m that the shapes shown on a tile's level cover, seen from above, by a raster
/// of half metres.
double covered_share(const Planted& layer, const Land& land, const TileId& id,
                     const Vector2d& corner) {
  constexpr int kSide = 512;
  constexpr double kCell_m = 0.5;
  std::vector<std::uint8_t> is_covered(kSide * kSide, 0);
  for (const auto& [number, instance] : layer.shown_on(id, land)) {
    const world::Shape& shape = *layer.shape_of(instance, id.level);
    const double turn_rad = instance.heading * 2.0 * std::numbers::pi / 65536.0;
    const Eigen::Rotation2Dd turned(turn_rad);
    const auto at = [&](std::uint32_t vertex) {
      return Vector2d((Planted::place_of(instance) - corner +
                       turned * (shape.vertices_steps[vertex].head<2>().cast<double>() *
                                 (world::kHeightStep_m * instance.scale / 4096.0))) /
                      kCell_m);
    };
    for (const world::Shape::Triangle& triangle : shape.triangles) {
      const Vector2d a = at(triangle.corners[0]);
      const Vector2d b = at(triangle.corners[1]);
      const Vector2d c = at(triangle.corners[2]);
      const Vector2d lowest = a.cwiseMin(b).cwiseMin(c).array().floor();
      const Vector2d highest = a.cwiseMax(b).cwiseMax(c).array().ceil();
      for (int j = std::max(0, static_cast<int>(lowest.y()));
           j < std::min<double>(kSide, highest.y()); ++j)
        for (int i = std::max(0, static_cast<int>(lowest.x()));
             i < std::min<double>(kSide, highest.x()); ++i) {
          const Vector2d p(i + 0.5, j + 0.5);
          const auto side = [&](const Vector2d& u, const Vector2d& v) {
            return (v - u).x() * (p - u).y() - (v - u).y() * (p - u).x();
          };
          const double s = side(a, b);
          const double t = side(b, c);
          const double u = side(c, a);
          if ((s >= 0 && t >= 0 && u >= 0) || (s <= 0 && t <= 0 && u <= 0))
            is_covered[static_cast<std::size_t>(j * kSide + i)] = 1;
        }
    }
  }
  return static_cast<double>(std::count(is_covered.begin(), is_covered.end(), 1)) / (kSide * kSide);
}

TEST(Vegetation, ForestCoversItsGroundAtEveryLevel) {
  const Planted& layer = planted();
  const Land land;
  // The same ground on tiles of all levels; of coarse ones the part that lies there.
  const double finest = covered_share(layer, land, {0, 2, 1}, {512.0, 256.0});
  EXPECT_GT(finest, 0.5);
  EXPECT_LT(finest, 0.95);
  for (const TileId id :
       {TileId{1, 1, 0}, TileId{2, 0, 0}, TileId{3, 0, 0}, TileId{4, 0, 0}, TileId{5, 0, 0}})
    EXPECT_NEAR(covered_share(layer, land, id, {512.0, 256.0}), finest, 0.17) << id.name();
}

TEST(Vegetation, TilesHoldNoMoreThanTheyCanShow) {
  const Planted& layer = planted();
  const Land land;
  for (const TileId id : {TileId{-2, 0, 0}, TileId{0, 0, 0}, TileId{2, 0, 0}, TileId{3, 0, 0},
                          TileId{4, 0, 0}, TileId{5, 0, 0}}) {
    const std::size_t num_instances = layer.on(id, land).size();
    // A piece of forest for each cell of the terrain, and what reaches over the border.
    EXPECT_LT(num_instances, 80000U) << id.name();
    EXPECT_GT(num_instances, id.level < 0 ? 20U : 1500U) << id.name();
  }
  EXPECT_TRUE(layer.on({8, 0, 0}, land).empty());
}

TEST(Vegetation, IdsAreThoseOfTheirCellsInAllTiles) {
  const Planted& layer = planted();
  Land land;
  std::map<std::uint32_t, Instance> by_id;
  for (const Cover cover : {Cover::Forest}) {
    land.cover_at = [cover](const Vector2d&) { return cover; };
    for (const TileId id :
         {TileId{-1, 3, 5}, TileId{0, 1, 2}, TileId{2, 0, 0}, TileId{3, 0, 0}, TileId{4, 0, 0}})
      for (const Instance& instance : layer.on(id, land)) {
        const std::uint32_t number = instance.provenance.instance_id;
        EXPECT_NE(number & 0x80000000U, 0U);
        EXPECT_EQ(instance.provenance.feature, number);
        const auto [entry, is_new] = by_id.emplace(number, instance);
        ASSERT_TRUE(is_new || entry->second == instance) << layer.name_of(instance);
      }
  }
  std::set<std::array<int, 3>> places;
  for (const auto& [id, instance] : by_id) {
    if (!layer.is_tree(instance)) continue;
    const Eigen::Vector3i& at = instance.place_steps;
    EXPECT_TRUE(places.insert({at.x(), at.y(), at.z()}).second);
  }
}

TEST(Vegetation, FeetAreOnTheGround) {
  const Planted& layer = planted();
  const Land land;
  for (const TileId id : {TileId{0, 0, 0}, TileId{3, 0, 0}})
    for (const Instance& instance : layer.on(id, land)) {
      const Vector2d at = Planted::place_of(instance);
      // Half a step of height, and half a step of place on a slope of 0.02.
      EXPECT_NEAR(instance.place_steps.z() * world::kHeightStep_m, land.ground_z_world(at), 6e-4);
    }
}

/// Instances of a kind by words of their names, on a tile of a cover at a height.
std::size_t count(double ground_m, Cover cover, const TileId& id,
                  const std::function<bool(const Planted&, const Instance&)>& is_counted) {
  const Planted layer("", 4096.0, ground_m);
  Land land;
  land.cover_at = [cover](const Vector2d&) { return cover; };
  std::size_t num = 0;
  for (const auto& [number, instance] : layer.shown_on(id, land))
    if (is_counted(layer, instance)) ++num;
  return num;
}

TEST(Vegetation, TreesEndAtTheTreeLineAndKrummholzAboutIt) {
  const auto is_tree = [](const Planted& layer, const Instance& instance) {
    return layer.is_tree(instance);
  };
  const auto is_conifer = [](const Planted& layer, const Instance& instance) {
    return layer.is_a(instance, "spruce_");
  };
  const auto is_dwarf = [](const Planted& layer, const Instance& instance) {
    return layer.is_a(instance, "mountain_pine");
  };
  // At the tests' latitude the line is at 5100 - 70 * (latitude - 15) - 900 m.
  const double line_m = 4200.0 - 70.0 * (world_of("plane").origin_lat_deg - 15.0);
  const TileId id{0, 0, 0};
  const std::size_t num_low = count(300.0, Cover::Land, {1, 0, 0}, is_tree);
  EXPECT_GT(num_low, 50U);
  EXPECT_EQ(count(line_m + 250.0, Cover::Land, {1, 0, 0}, is_tree), 0U);
  const std::size_t num_valley = count(300.0, Cover::Forest, id, is_tree);
  EXPECT_LT(count(line_m - 40.0, Cover::Forest, id, is_tree), num_valley);
  EXPECT_LT(count(300.0, Cover::Forest, id, is_conifer),
            count(line_m - 450.0, Cover::Forest, id, is_conifer));
  EXPECT_GT(count(line_m - 30.0, Cover::Grass, {1, 0, 0}, is_dwarf), 20U);
  EXPECT_EQ(count(300.0, Cover::Grass, {1, 0, 0}, is_dwarf), 0U);
}

TEST(Vegetation, CropsStandInRowsOnFieldsOnly) {
  const Planted& layer = planted();
  Land land;
  land.cover_at = [](const Vector2d& at) { return at.x() < 128.0 ? Cover::Crops : Cover::Grass; };
  std::map<int, int> headings;
  std::size_t num_crops = 0;
  for (const auto& [number, instance] : layer.shown_on({0, 0, 0}, land)) {
    if (!layer.is_a(instance, "corn") && !layer.is_a(instance, "wheat") &&
        !layer.is_a(instance, "vine"))
      continue;
    ++num_crops;
    // All of a piece is on the field.
    EXPECT_LT(Planted::place_of(instance).x() + 2.0, 128.0);
    ++headings[instance.heading & 0x7fff];  // rows have no front
  }
  EXPECT_GT(num_crops, 500U);
  EXPECT_LE(headings.size(), 5U);
}

/// A canopy of a block 400 m x 300 m whose trees are 8 m in the west and 24 m in the east.
std::filesystem::path write_canopy(const std::filesystem::path& file, double tall_m = 24.0,
                                   double easting_shift_m = 0.0) {
  const Vector2d origin = utm31(world_of("plane").origin_lat_deg, world_of("plane").origin_lon_deg);
  RasterSpec spec;
  spec.width = 400;
  spec.height = 400;
  spec.type = GDT_Float32;
  spec.nodata = -9999.0;
  spec.geotransform = {
      origin.x() - 500.0 + easting_shift_m, 2.5, 0.0, origin.y() + 500.0, 0.0, -2.5};
  spec.value = [=](double u, double v) {
    const double x = u - origin.x() - easting_shift_m;
    const double y = v - origin.y();
    if (x > 300.0) return -9999.0;
    if (std::abs(x) > 200.0 || std::abs(y) > 150.0) return 0.0;
    return x < 0.0 ? 8.0 : tall_m;
  };
  write_raster(file, spec);
  return file;
}

TEST(Vegetation, ACanopyRasterSaysWhereTreesStandAndHowTallTheyAre) {
  const ScratchFolder folder;
  const std::filesystem::path file = write_canopy(folder / "canopy.tif");
  const Planted layer(fmt::format("canopy = \"{}\"", file.string()), 2048.0);
  const world::LayerInfo info = layer.layer->info();
  EXPECT_EQ(info.source, "canopy.tif");
  ASSERT_EQ(info.counts.size(), 3U);
  EXPECT_EQ(info.counts[0].second, 400 * 400);
  EXPECT_EQ(info.counts[1].second, 80 * 400);   // 200 m of 2.5 m in the east
  EXPECT_EQ(info.counts[2].second, 160 * 120);  // 400 m x 300 m
  Land land;
  land.cover_at = [](const Vector2d&) { return Cover::Grass; };
  std::size_t num_low = 0;
  std::size_t num_tall = 0;
  for (const TileId id : {TileId{1, -1, -1}, TileId{1, 0, -1}, TileId{1, -1, 0}, TileId{1, 0, 0}})
    for (const auto& [number, instance] : layer.shown_on(id, land)) {
      if (!layer.is_tree(instance)) continue;
      const Vector2d at = Planted::place_of(instance);
      // Beyond the raster land cover decides again.
      if (at.x() > 270.0 || at.x() < -470.0 || std::abs(at.y()) > 470.0) continue;
      // The grid north of the zone is turned by up to 2 degrees here, and pixels are 2.5 m wide.
      EXPECT_LT(std::abs(at.x()), 212.0);
      EXPECT_LT(std::abs(at.y()), 162.0);
      if (std::abs(at.x()) > 185.0 || std::abs(at.y()) > 135.0 || std::abs(at.x()) < 15.0) continue;
      // Scales are rounded to 1/4096.
      EXPECT_NEAR(layer.height_m(instance), at.x() < 0.0 ? 8.0 : 24.0, 0.05);
      ++(at.x() < 0.0 ? num_low : num_tall);
    }
  // 170 m x 270 m each.
  EXPECT_GT(num_low, 900U);
  EXPECT_GT(num_tall, 900U);
}

TEST(Vegetation, CanopiesThatAreNoneAreRefused) {
  const ScratchFolder folder;
  const auto plant = [&](const std::filesystem::path& file) {
    const Planted layer(fmt::format("canopy = \"{}\"", file.string()), 2048.0);
  };
  expect_error(ErrorKind::Input, {"ground.tif", "pixel (", "1250", "trees"},
               [&] { plant(write_canopy(folder / "ground.tif", 1250.0)); });
  expect_error(ErrorKind::Input, {"away.tif", "beside the world's square"},
               [&] { plant(write_canopy(folder / "away.tif", 24.0, 90000.0)); });
  expect_error(ErrorKind::Io, {"missing.tif"}, [&] { plant(folder / "missing.tif"); });
  expect_error(ErrorKind::Config, {"canopy_nodata", "some"},
               [] { layer_of("canopy_nodata = \"some\"").validate(); });
}

TEST(Vegetation, RealCanopiesAreKept) {
  TERRACAST_NEEDS_SHARED_DATA("bilbao/bilbao_CDSM.tif");
  tiler::WorldOptions options = world_of_rasters({shared_data() / "bilbao/bilbao_DEM.tif"}, 2048.0);
  options.origin_lat_deg = 43.3123;
  options.origin_lon_deg = -2.9864;
  options.elevation[0].sea = "none";
  const auto surface = prepare(options);
  const core::Log log("tile", core::LogLevel::Off);
  tiler::InstanceIds ids;
  const auto file = shared_data() / "bilbao/bilbao_CDSM.tif";
  const auto layer = layer_of(fmt::format("canopy = \"{}\"", file.string()))
                         .kind_options()
                         .make({.frame = surface->frame(),
                                .size_m = 2048.0,
                                .seed = 1,
                                .surface = *surface,
                                .earlier = {},
                                .ids = ids,
                                .country = {},
                                .licence = {},
                                .accuracy = {},
                                .context = {.log = log, .num_threads = 0}});
  // The raster by GDAL alone, places in its zone by GeographicLib.
  GDALAllRegister();
  auto* dataset = static_cast<GDALDataset*>(GDALOpen(file.c_str(), GA_ReadOnly));
  ASSERT_NE(dataset, nullptr);
  double corner[6];
  ASSERT_EQ(dataset->GetGeoTransform(corner), CE_None);
  const int width = dataset->GetRasterXSize();
  const int height = dataset->GetRasterYSize();
  std::vector<float> heights_m(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, width, height, heights_m.data(),
                                                width, height, GDT_Float32, 0, 0, nullptr),
            CE_None);
  GDALClose(dataset);
  Land land;
  land.cover_at = [](const Vector2d&) { return Cover::Land; };
  std::size_t num_trees = 0;
  for (const TileId id : {TileId{0, 0, 0}, TileId{0, -2, 1}, TileId{0, 1, -3}}) {
    world::TileObjects objects;
    layer->add_objects(id, land, objects);
    for (const Instance& instance : objects.instances) {
      const std::string& name = layer->prototypes()[instance.prototype].name;
      const bool is_tree = name.starts_with("oak") || name.starts_with("birch") ||
                           name.starts_with("spruce") || name.starts_with("pine") ||
                           name.starts_with("poplar") || name.starts_with("palm");
      if (!is_tree) continue;
      ++num_trees;
      const geo::Geodetic place = surface->frame().geodetic_from_world(
          instance.place_steps.cast<double>() * world::kHeightStep_m);
      int zone = 0;
      bool is_north = false;
      double easting_m = 0.0;
      double northing_m = 0.0;
      GeographicLib::UTMUPS::Forward(place.lat_deg, place.lon_deg, zone, is_north, easting_m,
                                     northing_m, 30);
      // The tree is as tall as samples round it, which it lies between.
      const double column = (easting_m - corner[0]) / corner[1] - 0.5;
      const double row = (northing_m - corner[3]) / corner[5] - 0.5;
      double lowest_m = 1e9;
      double highest_m = -1e9;
      for (int j = static_cast<int>(row - 0.01); j <= static_cast<int>(row + 0.01) + 1; ++j)
        for (int i = static_cast<int>(column - 0.01); i <= static_cast<int>(column + 0.01) + 1;
             ++i) {
          const auto value = static_cast<double>(
              heights_m.at(static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(i)));
          lowest_m = std::min(lowest_m, value);
          highest_m = std::max(highest_m, value);
        }
      int top_steps = 0;
      for (const world::ShapeLevel& level : layer->prototypes()[instance.prototype].levels)
        for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
          top_steps = std::max(top_steps, vertex.z());
      const double height_of_tree_m = top_steps * world::kHeightStep_m * instance.scale / 4096.0;
      // Scales are rounded to 1/4096 of a tree of some 20 m.
      EXPECT_GE(height_of_tree_m, std::max(lowest_m, 2.5) - 0.05);
      EXPECT_LE(height_of_tree_m, highest_m + 0.05);
    }
  }
  EXPECT_GT(num_trees, 200U);
}

TEST(Vegetation, WorldsTooLargeForItsIdsAndASecondLayerAreRefused) {
  EXPECT_NO_THROW(Planted("", 57000.0));
  expect_error(ErrorKind::Config, {"vegetation", "size_m = 80000", "km"},
               [] { Planted("", 80000.0); });
  tiler::WorldOptions options = world_of("plane", 1024.0);
  options.layers = {layer_of(""), layer_of("name = \"more\"")};
  expect_error(ErrorKind::Config, {"one layer of kind vegetation"}, [&] { prepare(options); });
}

TEST(Vegetation, TilesOfAWorldWithItAreBuiltTheSameByAnyThreads) {
  tiler::WorldOptions options = world_of("plane", 2048.0);
  options.elevation[0].height_m = 400.0;
  options.layers = {layer_of("seed = 3")};
  const auto one = prepare(options, 1);
  const auto two = prepare(options, 2);
  EXPECT_EQ(one->input_hash(), two->input_hash());
  const TileId id{1, 0, -1};
  const world::Tile tile = tiler::build_tile(*one, id);
  EXPECT_EQ(tile, tiler::build_tile(*two, id));
  EXPECT_GT(tile.objects.instances.size(), 100U);
  EXPECT_GT(tile.objects_top_steps, tile.height_steps.front());
  options.seed = 2;
  EXPECT_NE(prepare(options)->input_hash(), one->input_hash());
}

}  // namespace
}  // namespace terracast::test
