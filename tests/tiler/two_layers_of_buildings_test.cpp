#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/tiler/building_layers.h"
#include "tests/tiler/vector_files.h"
#include "tiler/tile_builder.h"
#include "validate/world_check/coincident_solids.h"

// Layers of buildings whose sources hold the same ones: each stands once, the first layer's.
namespace terracast::test {
namespace {

using world::Solid;

constexpr double kSize_m = 1024.0;
constexpr std::uint64_t kWay = std::uint64_t{2} << 60;  // of numbers of features

/// A footprint; of one way of OpenStreetMap.
VectorSpec footprint(std::uint64_t way, const std::string& area,
                     std::vector<std::pair<std::string, std::string>> tags = {
                         {"building", "yes"}, {"height", "9"}, {"roof:shape", "flat"}}) {
  tags.emplace_back("osm_way_id", std::to_string(way));
  return {area, std::move(tags)};
}

VectorSpec part(std::uint64_t way, const std::string& area) {
  return footprint(way, area, {{"building", ""}, {"building:part", "yes"}, {"height", "12"}});
}

class TwoLayersOfBuildings : public testing::Test {
 protected:
  std::shared_ptr<const tiler::WorldSurface> world_of_layers(
      const std::vector<std::vector<VectorSpec>>& layers) {
    tiler::WorldOptions options = world_of("plane", kSize_m);
    options.elevation[0].height_m = 300.0;
    for (const std::vector<VectorSpec>& specs : layers) {
      const auto file = folder_ / fmt::format("{}.gpkg", num_files_++);
      write_vectors(file, "GPKG", specs, "EPSG:32631");
      options.layers.push_back(layer_of(files_key(file) + "number_field = \"osm_way_id\"\n" +
                                        fmt::format("name = \"{}\"\n", options.layers.size())));
    }
    return prepare(options);
  }

  static std::int64_t count(const tiler::WorldSurface& surface, std::size_t layer,
                            const std::string& name) {
    for (const auto& [key, value] : surface.layers().infos()[layer].counts)
      if (key == name) return value;
    return 0;
  }

  /// All that stand in the world, as tiles of a level have them, by layer and way.
  using Standing = std::map<std::pair<int, std::uint64_t>, Solid>;
  static Standing standing(const tiler::WorldSurface& surface, int level) {
    Standing all;
    const int half = static_cast<int>(kSize_m) / 2;
    std::set<std::string> built;
    for (int y = -half; y < half; y += 256)
      for (int x = -half; x < half; x += 256) {
        const world::TileId id = world::tile_at(level, x + 0.5, y + 0.5);
        if (!built.insert(id.name()).second) continue;
        for (Solid& solid : tiler::build_tile(surface, id).objects.solids)
          all.try_emplace({solid.provenance.layer, solid.provenance.feature - kWay},
                          std::move(solid));
      }
    return all;
  }
  static std::set<std::pair<int, std::uint64_t>> names(const Standing& standing) {
    std::set<std::pair<int, std::uint64_t>> names;
    for (const auto& [name, solid] : standing) names.insert(name);
    return names;
  }

  static void expect_no_common_planes(const tiler::WorldSurface& surface) {
    for (const int level : {0, 2}) {
      const Standing solids = standing(surface, level);
      std::vector<world_check::ShownSolid> shown;
      for (const auto& [name, solid] : solids)
        shown.push_back({solid.provenance.instance_id, solid.origin_steps,
                         world::shape_at(solid.levels, level)});
      for (const world_check::Coincident& pair : world_check::find_coincident(shown))
        ADD_FAILURE() << "level " << level << ": " << pair.area_m2 << " m2 at "
                      << (pair.place_steps * world::kHeightStep_m).transpose();
    }
  }

  const ScratchFolder folder_;
  int num_files_ = 0;
};

constexpr const char* kHas = "footprints that another layer of buildings has";
constexpr const char* kAcross = "footprints across another layer's buildings";

// Seen in November 2026: both stood, with all their faces in one plane, and the second was said to be on a road.
TEST_F(TwoLayersOfBuildings, OfOneFileStandOnce) {
  const std::vector<VectorSpec> town = {
      footprint(1, wkt(0, 0, 12, 9)),      footprint(2, wkt(12, 0, 12, 9)),
      footprint(3, wkt(-200, 90, 40, 25)), footprint(4, wkt(60, 60, 30, 20)),
      part(5, wkt(60, 60, 15, 20)),        part(6, wkt(75, 60, 15, 20))};
  std::vector<VectorSpec> more = town;
  more.push_back(footprint(7, wkt(150, -150, 12, 9)));
  const auto alone = world_of_layers({town});
  const auto other = world_of_layers({more});
  const auto both = world_of_layers({town, more});
  EXPECT_EQ(count(*both, 0, "buildings"), 5);
  EXPECT_EQ(count(*both, 0, kHas), 0);
  EXPECT_EQ(count(*both, 1, "buildings"), 1);
  EXPECT_EQ(count(*both, 1, kHas), 6);
  EXPECT_EQ(count(*both, 1, kAcross), 0);
  EXPECT_EQ(count(*both, 1, "footprints on roads"), 0);
  for (const int level : {0, 2}) {
    const Standing solids = standing(*both, level);
    const Standing first = standing(*alone, level);
    const Standing second = standing(*other, level);
    EXPECT_EQ(names(solids), (std::set<std::pair<int, std::uint64_t>>{
                                 {0, 1}, {0, 2}, {0, 3}, {0, 5}, {0, 6}, {1, 7}}));
    for (const auto& [name, solid] : first) EXPECT_EQ(solids.at(name), solid);
    EXPECT_EQ(solids.at({1, 7}).provenance.instance_id, second.at({0, 7}).provenance.instance_id);
  }
  expect_no_common_planes(*both);
  // Of three layers each is held against all before it.
  const auto three = world_of_layers({{town[0]}, {town[1]}, more});
  EXPECT_EQ(count(*three, 1, "buildings"), 1);
  EXPECT_EQ(count(*three, 2, kHas), 2);
  EXPECT_EQ(count(*three, 2, "buildings"), 4);
}

// The same house, drawn aside or as part of a larger one, and others beside it. Shares are products of lengths.
TEST_F(TwoLayersOfBuildings, KnowTheSameHouseFromItsNeighbour) {
  struct Case {
    double x_m, y_m, length_m, width_m;  // of the later one; the earlier one is 9 x 12 m
    bool stands, is_across;
  };
  const std::vector<Case> cases = {
      {0, 0, 9, 12, false, false},     // itself
      {3, 4, 9, 12, false, false},     // a third aside, both ways: 4/9
      {-3, 0, 9, 12, false, false},    // 2/3
      {9, 0, 9, 12, true, false},      // its neighbour
      {6, 0, 9, 12, true, true},       // a third aside: 1/3
      {6, 4, 9, 12, true, true},       // 2/9
      {0, 8, 9, 12, true, true},       // 1/3
      {0.5, 0.5, 5, 6, false, false},  // a part of it
      {0, 0, 18, 12, false, false},    // twice as large: 1/2
      {-4.5, 0, 36, 12, true, true},   // four times: 1/4
      {8.7, 11, 9, 12, true, false},   // touches a corner: 3 in 1000
  };
  std::vector<VectorSpec> first, second;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const double x = 60.0 * static_cast<double>(k % 4) - 120.0;
    const double y = 60.0 * static_cast<double>(k / 4) - 100.0;
    const Case& one = cases[k];
    first.push_back(footprint(k, wkt(x, y, 9, 12)));
    second.push_back(footprint(100 + k, wkt(x + one.x_m, y + one.y_m, one.length_m, one.width_m)));
  }
  const auto surface = world_of_layers({first, second});
  const auto stands = names(standing(*surface, 0));
  std::int64_t num_across = 0;
  std::int64_t num_standing = 0;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    EXPECT_TRUE(stands.contains({0, k})) << k;
    EXPECT_EQ(stands.contains({1, 100 + k}), cases[k].stands) << k;
    num_standing += cases[k].stands ? 1 : 0;
    num_across += cases[k].is_across ? 1 : 0;
  }
  EXPECT_EQ(count(*surface, 1, "buildings"), num_standing);
  EXPECT_EQ(count(*surface, 1, kHas), static_cast<std::int64_t>(cases.size()) - num_standing);
  EXPECT_EQ(count(*surface, 1, kAcross), num_across);
  EXPECT_EQ(count(*surface, 1, "footprints on roads"), 0);
  // Those across each other have walls, bottoms and tops in one plane by their sources.
  expect_no_common_planes(*surface);
  // The same of any order, and on tiles of any level.
  std::reverse(second.begin(), second.end());
  const auto turned = world_of_layers({first, second});
  for (const int level : {0, 2}) {
    const Standing solids = standing(*surface, level);
    EXPECT_EQ(names(solids), stands) << level;
    EXPECT_EQ(standing(*turned, level), solids) << level;
  }
}

TEST_F(TwoLayersOfBuildings, LeaveOrKeepABuildingWithItsParts) {
  std::vector<VectorSpec> first, second;
  // The earlier ones have 14/30 and 9/30 of it: of its first half nearly all, and 3/5; of its second nothing.
  const std::array<double, 2> lengths_m = {14.0, 9.0};
  for (std::uint64_t k = 0; k < 2; ++k) {
    const double x = 100.0 * static_cast<double>(k) - 80.0;
    first.push_back(footprint(k, wkt(x, 0, lengths_m[k], 20)));
    second.push_back(footprint(10 + k, wkt(x, 0, 30, 20)));
    second.push_back(part(20 + k, wkt(x, 0, 15, 20)));
    second.push_back(part(30 + k, wkt(x + 15, 0, 15, 20)));
  }
  const auto surface = world_of_layers({first, second});
  EXPECT_EQ(names(standing(*surface, 0)),
            (std::set<std::pair<int, std::uint64_t>>{{0, 0}, {0, 1}, {1, 21}, {1, 31}}));
  EXPECT_EQ(count(*surface, 1, kHas), 3);
  EXPECT_EQ(count(*surface, 1, kAcross), 1);
  EXPECT_EQ(count(*surface, 1, "outlines replaced by parts"), 1);
  expect_no_common_planes(*surface);
}

/// What a house looks like follows from what stands about it: how dense the town is, and where others
/// are built on to it. As of one layer that has them all.
TEST_F(TwoLayersOfBuildings, SeeEachOthersNeighbours) {
  std::vector<VectorSpec> first, second, all;
  std::uint64_t way = 0;
  for (int row = 0; row < 12; ++row)  // of houses wall to wall, which say nothing of their heights
    for (int k = 0; k < 16; ++k) {
      auto& specs = (k + row) % 2 == 0 ? first : second;
      specs.push_back(footprint(++way, wkt(12.0 * k - 96.0, 20.0 * row - 120.0, 12, 14),
                                {{"building", "yes"}}));
      all.push_back(specs.back());
    }
  const Standing split = standing(*world_of_layers({first, second}), 0);
  const Standing one = standing(*world_of_layers({all}), 0);
  const Standing alone = standing(*world_of_layers({second}), 0);
  ASSERT_EQ(split.size(), all.size());
  ASSERT_EQ(alone.size(), second.size());
  std::size_t num_seen = 0, num_like_alone = 0;
  for (const auto& [name, solid] : split) {
    if (name.first != 1) continue;
    ++num_seen;
    EXPECT_EQ(solid.levels, one.at({0, name.second}).levels) << name.second;
    num_like_alone += solid.levels == alone.at({0, name.second}).levels ? 1 : 0;
  }
  EXPECT_EQ(num_seen, second.size());
  // Alone none has a neighbour wall to wall, and all stand in a town half as dense.
  EXPECT_EQ(num_like_alone, 0U);
}

}  // namespace
}  // namespace terracast::test
