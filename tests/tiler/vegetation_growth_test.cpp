#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/tiler/planted_layer.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using world::Cover;
using world::Instance;
using world::TileId;

TEST(Vegetation, NothingStandsWhereThereIsNoRoom) {
  const Planted& layer = planted();
  PlantedLand land = with_things();
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

TEST(Vegetation, TownsHaveThicketsOnSlopes) {
  const auto num_bushes = [](double slope) {
    const Planted town("", 2048.0, 300.0, 1, slope);
    PlantedLand land;
    land.cover_at = [](const Vector2d&) { return Cover::BuiltUp; };
    land.z_at = [slope](const Vector2d& place) { return 300.0 + slope * place.x(); };
    int num = 0;
    for (int x = -2; x < 2; ++x)
      for (const Instance& instance : town.on({0, x, 0}, land))
        num += town.is_a(instance, "bush") ? 1 : 0;
    return num;
  };
  const int num_on_level = num_bushes(0.02);
  EXPECT_GT(num_on_level, 20);
  // 0.14 and 0.64 of places, of which some are as near to trees, others or their own kind.
  EXPECT_GT(num_bushes(0.5), 2 * num_on_level);
}

TEST(Vegetation, NothingGrowsInWaterOnSnowOrBeyondTheSquare) {
  const Planted small("", 1024.0);
  PlantedLand land;
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
    PlantedLand land;
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
  PlantedLand land;
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

/// Instances of a kind by words of their names, on a tile of a cover at a height.
std::size_t count(double ground_m, Cover cover, const TileId& id,
                  const std::function<bool(const Planted&, const Instance&)>& is_counted) {
  const Planted layer("", 4096.0, ground_m);
  PlantedLand land;
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
  PlantedLand land;
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

}  // namespace
}  // namespace terracast::test
