#include "batch/dataset/ground_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <GeographicLib/Geodesic.hpp>
#include <cmath>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/random.h"

namespace terracast::batch {
namespace {

using testing::ElementsAre;

double geodesic_m(double lat1_deg, double lon1_deg, double lat2_deg, double lon2_deg) {
  double distance_m = 0.0;
  GeographicLib::Geodesic::WGS84().Inverse(lat1_deg, lon1_deg, lat2_deg, lon2_deg, distance_m);
  return distance_m;
}

TEST(GroundCells, AreCountedAsTheHeaderSaysAndNoneByALuckyRounding) {
  // 64 bits of mantissa; no count may hang on the last bit of somebody's cosine.
  for (int band = 0; band < kGroundBands; ++band) {
    const long double middle_deg = (band + 0.5L) * 0.0009L - 90.0L;
    const long double count =
        400750.0L * std::cos(middle_deg * std::numbers::pi_v<long double> / 180.0L);
    ASSERT_GT(std::abs(count - std::floor(count) - 0.5L), 1e-8L) << band;
    ASSERT_EQ(cells_in_band(band), std::max(1, static_cast<int>(std::floor(count + 0.5L)))) << band;
  }
}

TEST(GroundCells, HoldTheirPlacesAndMeetWithoutGaps) {
  for (std::uint64_t i = 0; i < 100000; ++i) {
    const double lat_deg = core::random_between(-90.0, 90.0, 1, 1, i);
    const double lon_deg = core::random_between(-180.0, 180.0, 1, 2, i);
    const GroundCell cell = ground_cell_at(lat_deg, lon_deg);
    const CellBounds bounds = bounds_of(cell);
    ASSERT_LE(bounds.south_deg, lat_deg);
    ASSERT_GE(bounds.north_deg, lat_deg);
    ASSERT_LE(bounds.west_deg, lon_deg);
    ASSERT_GE(bounds.east_deg, lon_deg);
    const double middle_deg = 0.5 * (bounds.west_deg + bounds.east_deg);
    ASSERT_EQ(ground_cell_at(lat_deg, middle_deg + 360.0), cell);
    ASSERT_EQ(ground_cell_at(lat_deg, middle_deg - 720.0), cell);
    const int east = (cell.column + 1) % cells_in_band(cell.band);
    ASSERT_EQ(ground_cell_at(lat_deg, bounds.east_deg + 1e-9), (GroundCell{cell.band, east}));
  }
  EXPECT_EQ(ground_cell_at(90.0, 0.0).band, kGroundBands - 1);
  EXPECT_EQ(ground_cell_at(-90.0, 0.0).band, 0);
  EXPECT_EQ(ground_cell_at(0.0, -180.0).column, 0);
  EXPECT_EQ(ground_cell_at(0.0, 180.0).column, 0);
  EXPECT_EQ(ground_cell_at(0.0, 180.0 - 1e-9).column, cells_in_band(100000) - 1);
}

TEST(GroundCells, AreAsLargeAsTheHeaderSays) {
  for (const double lat_deg : {-89.0, -60.0, -17.3, 0.0, 42.5, 71.0, 88.9}) {
    const CellBounds bounds = bounds_of(ground_cell_at(lat_deg, 12.3));
    const double height_m =
        geodesic_m(bounds.south_deg, bounds.west_deg, bounds.north_deg, bounds.west_deg);
    EXPECT_GE(height_m, 99.5);
    EXPECT_LE(height_m, 100.55);
    const double middle_deg = 0.5 * (bounds.south_deg + bounds.north_deg);
    const double width_m = geodesic_m(middle_deg, bounds.west_deg, middle_deg, bounds.east_deg);
    EXPECT_GE(width_m, 99.99);
    EXPECT_LE(width_m, 100.4);
    EXPECT_LE(geodesic_m(bounds.south_deg, bounds.west_deg, bounds.north_deg, bounds.east_deg),
              kGroundCellReach_m);
  }
}

TEST(CellRuns, AreJoinedIntoTheSetThatTheyCover) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    std::vector<CellRun> runs;
    std::set<GroundCell> cells;
    const std::uint64_t num_runs = core::random_bits(seed, 1, 0) % 30;
    for (std::uint64_t i = 0; i < num_runs; ++i) {
      const auto draw = [&](std::uint64_t stream, int most) {
        return static_cast<int>(core::random_bits(seed, stream, i) %
                                static_cast<std::uint64_t>(most));
      };
      const CellRun run{100000 + draw(2, 4), draw(3, 40), 1 + draw(4, 6)};
      runs.push_back(run);
      for (int k = 0; k < run.num_cells; ++k) cells.insert({run.band, run.first_column + k});
    }
    join_runs(runs);
    GroundSeen seen{.ground = "earth", .within_m = 500.0, .runs = runs};
    ASSERT_EQ(seen.num_cells(), static_cast<std::int64_t>(cells.size()));
    for (int band = 99999; band < 100006; ++band)
      for (int column = 0; column < 60; ++column)
        ASSERT_EQ(seen.holds({band, column}), cells.contains({band, column}));
    for (std::size_t i = 1; i < runs.size(); ++i) {
      ASSERT_LT(runs[i - 1], runs[i]);
      ASSERT_TRUE(runs[i - 1].band < runs[i].band ||
                  runs[i - 1].first_column + runs[i - 1].num_cells < runs[i].first_column);
    }
    const core::Json json = core::Json::parse(json_from_ground(seen).text(-1), "ground.json");
    ASSERT_EQ(ground_from_json(json, "ground.json"), seen);
  }
}

TEST(GroundJson, IsCompactAndSaysAnyDistanceAsNull) {
  const GroundSeen seen{.ground = "0123456789abcdef",
                        .within_m = std::numeric_limits<double>::infinity(),
                        .runs = {{100000, 5, 3}, {100000, 10, 1}, {100001, 4, 6}}};
  EXPECT_EQ(json_from_ground(seen).text(-1),
            R"({"ground":"0123456789abcdef","within_m":null,"cells":10,)"
            R"("bands":[[100000,5,3,10,1],[100001,4,6]]})");
  EXPECT_EQ(ground_from_json(json_from_ground(seen), "ground.json"), seen);
}

TEST(GroundJson, ThatNoSetCanHaveIsRefused) {
  const auto is_refused = [](const std::string& within, const std::string& cells,
                             const std::string& bands) {
    const std::string text = R"({"ground":"earth","within_m":)" + within + R"(,"cells":)" + cells +
                             R"(,"bands":)" + bands + "}";
    try {
      ground_from_json(core::Json::parse(text, "ground.json"), "ground.json");
    } catch (const core::Error& error) {
      return error.kind() == core::ErrorKind::Input;
    }
    return false;
  };
  EXPECT_FALSE(is_refused("null", "4", "[[100000,5,3,10,1]]"));
  EXPECT_TRUE(is_refused("0", "4", "[[100000,5,3,10,1]]"));
  EXPECT_TRUE(is_refused("null", "5", "[[100000,5,3,10,1]]"));  // another count
  EXPECT_TRUE(is_refused("null", "4", "[[200000,5,4]]"));       // no such band
  EXPECT_TRUE(is_refused("null", "4", "[[-1,5,4]]"));
  EXPECT_TRUE(is_refused("null", "4", "[[100000,5,3],[100000,10,1]]"));  // a band twice
  EXPECT_TRUE(is_refused("null", "4", "[[100000,5,3,8,1]]"));            // would be one run
  EXPECT_TRUE(is_refused("null", "4", "[[100000,10,3,5,1]]"));           // not in order
  EXPECT_TRUE(is_refused("null", "0", "[[100000,5,0]]"));
  EXPECT_TRUE(is_refused("null", "2", "[[100000,400749,2]]"));  // beyond the meridian
  EXPECT_TRUE(is_refused("null", "4", "[[100000,5]]"));
  EXPECT_TRUE(is_refused("null", "4", "[[]]"));
  EXPECT_TRUE(is_refused("null", "4", "[[100000,5,9223372036854775807]]"));
}

}  // namespace
}  // namespace terracast::batch
