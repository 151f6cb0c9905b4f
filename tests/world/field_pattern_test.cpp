#include "world/field_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <vector>

#include "core/random.h"
#include "world/tile.h"

namespace terracast::world {
namespace {

using Eigen::Vector2d;

Vector2d drawn_place(std::uint64_t i) {
  return {core::random_between(-25e3, 25e3, 1, 1, i), core::random_between(-25e3, 25e3, 1, 2, i)};
}

// Nothing else tells where a field ends: within the distance to its border all places are of it.
TEST(FieldPattern, FieldsReachAsFarAsTheirBorders) {
  const FieldPattern fields(11, true);
  int num_crossed = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const Vector2d at = drawn_place(i);
    const FieldPattern::Place place = fields.at(at);
    ASSERT_GE(place.edge_m, 0.0);
    ASSERT_LT(place.edge_m, 66.5);  // half of the widest: 23 pieces and 5 more at either side
    for (int k = 0; k < 16; ++k) {
      const double turn = 0.3927 * k;
      const Vector2d out(std::cos(turn), std::sin(turn));
      EXPECT_EQ(fields.at(at + 0.999 * place.edge_m * out).key, place.key);
      EXPECT_EQ(fields.at(at + 0.999 * place.edge_m * out).crop, place.crop);
      num_crossed += fields.at(at + (place.edge_m + 0.5) * out).key != place.key ? 1 : 0;
    }
  }
  EXPECT_GT(num_crossed, 400);  // half a metre farther some direction leaves it
}

// Borders of meadows are found by the field on either side alone.
TEST(FieldPattern, BordersOfMeadowsAreBentAndTheOthersStraight) {
  const FieldPattern fields(11, true);
  int num_moved = 0;
  std::vector<double> ratios;  // of what is stated to how far a border is
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const Vector2d at = drawn_place(i);
    const FieldPattern::Place straight = fields.at(at);
    for (const Cover cover : {Cover::Crops, Cover::Land, Cover::BuiltUp}) {
      EXPECT_EQ(fields.at(at, cover).key, straight.key);
      EXPECT_EQ(fields.at(at, cover).edge_m, straight.edge_m);
    }
    const FieldPattern::Place bent = fields.at(at, Cover::Grass);
    num_moved += bent.key != straight.key ? 1 : 0;
    // No border strays farther than is stated.
    if (straight.edge_m > FieldPattern::kMostBent_m) {
      EXPECT_EQ(bent.key, straight.key);
    }
    if (i % 3 != 0 || bent.edge_m < 2.0 || bent.edge_m > 12.0) continue;
    double nearest_m = 1e9;
    for (int k = 0; k < 48; ++k) {
      const Vector2d out(std::cos(k * 0.1309), std::sin(k * 0.1309));
      for (double out_m = 0.5; out_m < std::min(nearest_m, 30.0); out_m += 0.1)
        if (fields.at(at + out_m * out, Cover::Grass).key != bent.key) nearest_m = out_m;
    }
    ratios.push_back(bent.edge_m / nearest_m);
  }
  EXPECT_GT(num_moved, 40);
  ASSERT_GT(ratios.size(), 150U);
  std::sort(ratios.begin(), ratios.end());
  // Steps of 0.1 m, and half as much on average beyond the border.
  EXPECT_NEAR(ratios[ratios.size() / 2], 1.0, 0.06);
  EXPECT_GT(ratios[ratios.size() / 20], 0.75);
  EXPECT_LT(ratios[ratios.size() - ratios.size() / 20], 1.3);
}

TEST(FieldPattern, PlacesAreMeasuredAlongRowsAndAcross) {
  const FieldPattern fields(3, true);
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Vector2d at = drawn_place(i);
    const FieldPattern::Place place = fields.at(at);
    if (place.edge_m < 0.5) continue;
    const FieldPattern::Region region = fields.region_at(at);
    const FieldPattern::Place ahead = fields.at(at + 0.4 * region.along);
    EXPECT_NEAR(ahead.along_m - place.along_m, 0.4, 1e-9);
    EXPECT_NEAR(ahead.across_m, place.across_m, 1e-9);
    const FieldPattern::Place left =
        fields.at(at + 0.4 * Vector2d(-region.along.y(), region.along.x()));
    EXPECT_NEAR(left.across_m - place.across_m, 0.4, 1e-9);
  }
}

// Seen 2026-11: within a region all fields were alike, as a pattern that repeats.
TEST(FieldPattern, FieldsOfARegionDiffer) {
  const FieldPattern fields(7, true);
  for (std::uint64_t i = 0; i < 50; ++i) {
    const FieldPattern::Region region = fields.region_at(drawn_place(i));
    // Widths of the strips that a line across them meets, lengths of the fields along one of these.
    std::set<std::int64_t> widths;
    std::set<std::int64_t> lengths;
    FieldPattern::Field across = fields.field_of(region, 0, -400);
    FieldPattern::Field along = fields.field_of(region, -400, 0);
    bool is_whole_across = false;  // the first may begin before the line
    bool is_whole_along = false;
    for (std::int64_t piece = -399; piece <= 400; ++piece) {
      const FieldPattern::Field next_across = fields.field_of(region, 0, piece);
      if (next_across.piece_across != across.piece_across + 1) {
        EXPECT_EQ(next_across.piece_across, 0);
        if (is_whole_across) widths.insert(across.piece_across + 1);
        is_whole_across = true;
      }
      const FieldPattern::Field next_along = fields.field_of(region, piece, 0);
      if (next_along.piece_along != along.piece_along + 1) {
        EXPECT_EQ(next_along.piece_along, 0);
        if (is_whole_along) lengths.insert(along.piece_along + 1);
        is_whole_along = true;
      }
      across = next_across;
      along = next_along;
    }
    ASSERT_GE(widths.size(), 4U);
    ASSERT_GE(lengths.size(), 4U);
    EXPECT_GE(2 * *widths.begin(), region.pieces_across);
    EXPECT_LE(2 * *widths.rbegin(), 3 * region.pieces_across);
    EXPECT_GE(2 * *lengths.begin(), region.pieces_along);
    EXPECT_LE(2 * *lengths.rbegin(), 3 * region.pieces_along);
  }
}

TEST(FieldPattern, CropsHaveTheirSharesAndVinesTheirClimate) {
  for (const bool grows_vines : {true, false}) {
    const FieldPattern fields(5, grows_vines);
    std::array<int, kNumCrops> counts{};
    constexpr int kPlaces = 20000;
    for (std::uint64_t i = 0; i < kPlaces; ++i)
      ++counts[static_cast<std::size_t>(fields.at(drawn_place(i)).crop)];
    // Some 10 000 of the fields are met: shares of them to a percent, by area to two.
    const double vines = counts[static_cast<std::size_t>(Crop::Vine)] / double{kPlaces};
    const double wheat = counts[static_cast<std::size_t>(Crop::Wheat)] / double{kPlaces};
    EXPECT_NEAR(vines, grows_vines ? 0.14 : 0.0, 0.02);
    EXPECT_NEAR(wheat, grows_vines ? 0.22 : 0.36, 0.02);
    for (const int count : counts) EXPECT_TRUE(count > 0 || !grows_vines);
  }
  EXPECT_TRUE(FieldPattern::grows_vines(43.0));
  EXPECT_FALSE(FieldPattern::grows_vines(60.0));
}

}  // namespace
}  // namespace terracast::world
