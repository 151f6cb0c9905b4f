#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/random.h"
#include "tiler/box_index.h"
#include "tiler/buildings/town.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using tiler::BoxIndex;
using tiler::FeatureTags;
using tiler::Town;
using tiler::VectorFeature;

VectorFeature rectangle(std::uint64_t number, const Vector2d& low, const Vector2d& size,
                        std::vector<std::pair<std::string, std::string>> tags) {
  VectorFeature feature;
  feature.number = number;
  feature.kind = tiler::FeatureKind::Area;
  feature.tags = FeatureTags(std::move(tags));
  feature.parts_world = {
      {{low, low + Vector2d(size.x(), 0.0), low + size, low + Vector2d(0.0, size.y())}}};
  return feature;
}

Town town_of(const std::vector<VectorFeature>& features,
             const std::vector<const Town*>& earlier = {}) {
  const auto nowhere = [](const Vector2d&) { return false; };
  return tiler::build_town(features, nullptr,
                           {.is_water = nowhere,
                            .is_sea = nowhere,
                            .is_taken = nowhere,
                            .height_m = [](const Vector2d&) { return 300.0; },
                            .earlier = earlier},
                           8192.0, 1);
}

std::int64_t count_of(const Town& town, const std::string& name) {
  for (const auto& [key, value] : town.counts)
    if (key == name) return value;
  return 0;
}

TEST(CrowdedTowns, AHundredThousandCopiesOfAFootprintAreOneAndCostNoPairs) {
  constexpr int kNum = 100'000;
  std::vector<VectorFeature> features;
  for (int k = 0; k < kNum; ++k)
    features.push_back(rectangle(static_cast<std::uint64_t>(k + 1), {0, 0}, {12, 10},
                                 {{"building", "yes"}, {"height", std::to_string(5 + k % 9)}}));
  const Town town = town_of(features);
  ASSERT_EQ(town.buildings.size(), 1U);
  EXPECT_EQ(town.buildings[0].feature, 1U);  // of equally large ones that of the lowest number
  EXPECT_EQ(count_of(town, "footprints in others left out"), kNum - 1);
  EXPECT_EQ(count_of(town, "footprints left out in crowds of others"), 0);
  // Itself, in each of the passes over pairs.
  EXPECT_LE(town.num_pairs, 8);
}

// Parts may stand over each other, so that copies with other tags are none.
TEST(CrowdedTowns, PartsOnOnePlaceCostNoMorePairsThanACellHolds) {
  const auto stacked = [](int num) {
    std::vector<VectorFeature> features = {
        rectangle(1, {-20, -20}, {45, 45}, {{"building", "yes"}, {"height", "9"}})};
    for (int k = 0; k < num; ++k)
      features.push_back(rectangle(static_cast<std::uint64_t>(k + 2), {0, 0}, {12, 10},
                                   {{"building:part", "yes"},
                                    {"min_height", std::to_string(k % 100)},
                                    {"height", std::to_string(100 + k)}}));
    return town_of(features);
  };
  constexpr auto kMost = static_cast<std::int64_t>(tiler::kMostInCell);
  const Town few = stacked(3000), many = stacked(9000);
  for (const auto& [town, num] : {std::pair(&few, 3000), {&many, 9000}}) {
    // The largest stay: the house, then those of the lowest numbers.
    ASSERT_EQ(town->buildings.size(), tiler::kMostInCell);
    EXPECT_FALSE(town->buildings[0].is_part);
    EXPECT_EQ(town->buildings.back().feature, tiler::kMostInCell);
    EXPECT_EQ(count_of(*town, "footprints left out in crowds of others"), num + 1 - kMost);
  }
  EXPECT_EQ(few.num_pairs, many.num_pairs);
  EXPECT_GT(few.num_pairs, kMost);
  EXPECT_LE(few.num_pairs, 8 * kMost * kMost);  // of at most so many passes over pairs
}

// All through one place, each in many cells: boxes of 2 km are in four cells of their own level.
TEST(CrowdedTowns, LongFootprintsAreInFewCells) {
  std::vector<VectorFeature> features;
  for (int k = 0; k < 3000; ++k) {
    VectorFeature feature = rectangle(static_cast<std::uint64_t>(k + 1), {0, 0}, {1, 1}, {});
    const double turned = 0.1 + 1e-4 * k;
    const Vector2d along(std::cos(turned), std::sin(turned)), across(-along.y(), along.x());
    feature.parts_world = {{{-1000.0 * along - across, 1000.0 * along - across,
                             1000.0 * along + across, -1000.0 * along + across}}};
    feature.tags = FeatureTags({{"building:part", "yes"}, {"height", std::to_string(5 + k)}});
    features.push_back(std::move(feature));
  }
  const Town town = town_of(features);
  EXPECT_EQ(town.buildings.size(), tiler::kMostInCell);
  EXPECT_EQ(count_of(town, "footprints left out in crowds of others"),
            3000 - static_cast<std::int64_t>(tiler::kMostInCell));
}

TEST(CrowdedTowns, AreHeldAgainstTheEarlierOneByNeighboursAlone) {
  const auto houses = [](int side, std::uint64_t first) {
    std::vector<VectorFeature> features;
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i)
        features.push_back(rectangle(first + features.size(),
                                     {24.0 * i - 1200.0, 24.0 * j - 1200.0}, {12, 10},
                                     {{"building", "yes"}}));
    return features;
  };
  constexpr int kSide = 80;
  constexpr std::int64_t kNum = kSide * kSide;
  const Town earlier = town_of(houses(kSide, 1));
  ASSERT_EQ(earlier.buildings.size(), static_cast<std::size_t>(kNum));
  const Town later = town_of(houses(kSide, 1 + kNum), {&earlier});
  EXPECT_TRUE(later.buildings.empty());
  EXPECT_EQ(count_of(later, "footprints that another layer of buildings has"), kNum);
  // Two by two in a cell, and four cells at most.
  EXPECT_LE(later.num_pairs, 16 * kNum);
  // As many copies of one of them.
  std::vector<VectorFeature> copies;
  for (std::int64_t k = 0; k < kNum; ++k)
    copies.push_back(rectangle(static_cast<std::uint64_t>(k + 1), {0, 0}, {12, 10}, {}));
  const Town none = town_of(copies, {&earlier});
  EXPECT_TRUE(none.buildings.empty());
  EXPECT_EQ(count_of(none, "footprints that another layer of buildings has"), 1);
  EXPECT_LE(none.num_pairs, 16);
}

TEST(BoxIndex, GivesWhatLiesInABoxOnceAndInOrder) {
  struct Box {
    Vector2d low, high;
  };
  std::vector<Box> boxes;
  BoxIndex index;
  const auto random = [](std::uint64_t k, std::uint64_t stream) {
    return core::random_unit(7, k, stream);
  };
  for (std::uint32_t row = 0; row < 600; ++row) {
    // From 1 m to 4 km wide, about the origin, where cells of all levels meet.
    const double size = std::exp2(12.0 * random(row, 0));
    const Vector2d low(3000.0 * (random(row, 1) - 0.5), 3000.0 * (random(row, 2) - 0.5));
    boxes.push_back({low, low + size * Vector2d(1.0, random(row, 3))});
    index.add(row, boxes.back().low, boxes.back().high);
    EXPECT_LE(BoxIndex::cells_of(boxes.back().low, boxes.back().high).size(), 4U);
  }
  index.finish();
  for (std::uint64_t k = 0; k < 400; ++k) {
    const Vector2d low(4000.0 * (random(k, 4) - 0.5), 4000.0 * (random(k, 5) - 0.5));
    const Vector2d high = low + std::exp2(11.0 * random(k, 6)) * Vector2d(1.0, 1.0);
    const auto before = static_cast<std::uint32_t>(700.0 * random(k, 7));
    const std::vector<std::uint32_t> rows = index.rows_in(low, high, before);
    EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end()));
    EXPECT_EQ(std::adjacent_find(rows.begin(), rows.end()), rows.end());
    EXPECT_TRUE(rows.empty() || rows.back() < before);
    for (std::uint32_t row = 0; row < std::min<std::uint32_t>(before, 600); ++row) {
      const bool meets = (boxes[row].low.array() <= high.array()).all() &&
                         (boxes[row].high.array() >= low.array()).all();
      EXPECT_TRUE(!meets || std::binary_search(rows.begin(), rows.end(), row)) << row;
    }
    std::vector<std::uint32_t> visited;
    const std::size_t most = rows.size() / 2 + 1;
    index.visit(low, high, before, [&](std::uint32_t row) {
      visited.push_back(row);
      return visited.size() < most;
    });
    EXPECT_EQ(
        visited,
        std::vector<std::uint32_t>(
            rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(std::min(most, rows.size()))));
  }
}

}  // namespace
}  // namespace terracast::test
