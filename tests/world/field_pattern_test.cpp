#include "world/field_pattern.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/random.h"

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
    ASSERT_LT(place.edge_m, 50.0);  // half of the widest
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
