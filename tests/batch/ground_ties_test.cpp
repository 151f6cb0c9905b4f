#include "batch/dataset/ground_ties.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "tests/batch/random_grounds.h"

namespace terracast::batch {
namespace {

std::vector<const GroundSeen*> pointers(const std::vector<GroundSeen>& grounds) {
  std::vector<const GroundSeen*> result;
  for (const GroundSeen& seen : grounds) result.push_back(&seen);
  return result;
}

/// Components by comparing all pairs.
std::vector<int> brute_components(const std::vector<std::vector<double>>& distances,
                                  double margin_m) {
  std::vector<int> components(distances.size());
  std::iota(components.begin(), components.end(), 0);
  for (std::size_t i = 0; i < components.size(); ++i)
    for (std::size_t k = i + 1; k < components.size(); ++k)
      if (distances[i][k] < margin_m) {
        const int from = components[k], to = components[i];
        for (int& component : components)
          if (component == from) component = to;
      }
  return components;
}

/// Whether grounds that are together in one are so in the other.
bool is_refinement(const std::vector<int>& fine, const std::vector<int>& coarse) {
  for (std::size_t i = 0; i < fine.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (fine[i] == fine[k] && coarse[i] != coarse[k]) return false;
  return true;
}

TEST(GroundTies, AreThoseOfAllPairsOfCells) {
  const geo::Geodetic places[] = {{.lat_deg = 42.5, .lon_deg = 1.5},
                                  {.lat_deg = -16.9, .lon_deg = 179.999},
                                  {.lat_deg = 66.0, .lon_deg = -180.0},
                                  {.lat_deg = -88.9, .lon_deg = 30.0},
                                  {.lat_deg = 0.0, .lon_deg = 0.0}};
  int num_together = 0;
  int num_apart = 0;
  for (const geo::Geodetic& place : places)
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      const std::vector<GroundSeen> grounds = random_grounds(seed, place, 12, 8000.0);
      std::vector<std::vector<double>> distances(grounds.size(),
                                                 std::vector<double>(grounds.size()));
      for (std::size_t i = 0; i < grounds.size(); ++i)
        for (std::size_t k = i + 1; k < grounds.size(); ++k)
          distances[i][k] = distances[k][i] = distance_m(grounds[i], grounds[k]);
      for (const double margin_m : {0.0, 150.0, 400.0, 1500.0}) {
        const GroundTies ties = tie_grounds(pointers(grounds), margin_m);
        ASSERT_TRUE(is_refinement(brute_components(distances, margin_m), ties.components))
            << "not tied though near: seed " << seed << " at " << place.lat_deg;
        ASSERT_TRUE(is_refinement(ties.components, brute_components(distances, 1.012 * margin_m)))
            << "tied though apart: seed " << seed << " at " << place.lat_deg;
        ASSERT_EQ(
            static_cast<int>(ties.ties.size() + static_cast<std::size_t>(ties.num_components)),
            static_cast<int>(grounds.size()));
        for (const GroundTie& tie : ties.ties) {
          const double apart_m =
              distances[static_cast<std::size_t>(tie.first)][static_cast<std::size_t>(tie.second)];
          ASSERT_EQ(tie.is_shared, apart_m < 0.0);
          ASSERT_LT(apart_m, 1.012 * margin_m + (tie.is_shared ? 1.0 : 0.0));
        }
        num_together += ties.num_components < 12 ? 1 : 0;
        num_apart += ties.num_components > 1 ? 1 : 0;
      }
    }
  EXPECT_GT(num_together, 30);
  EXPECT_GT(num_apart, 30);
}

std::vector<int> components_of(const std::vector<CellRun>& runs, double margin_m) {
  std::vector<GroundSeen> grounds;
  for (const CellRun& run : runs)
    grounds.push_back({.ground = "earth", .within_m = 1000.0, .runs = {run}});
  return tie_grounds(pointers(grounds), margin_m).components;
}

TEST(GroundTies, OfOneBandReachAcrossThe180DegreeMeridian) {
  const int count = cells_in_band(140000);
  const std::vector<CellRun> runs = {{140000, 3, 2}, {140000, count - 4, 2}};  // 5 cells apart
  EXPECT_THAT(components_of(runs, 480.0), testing::ElementsAre(0, 1));
  EXPECT_THAT(components_of(runs, 510.0), testing::ElementsAre(0, 0));
}

TEST(GroundTies, OfALongRunHoldBehindAShortOneWithinIt) {
  const std::vector<CellRun> runs = {
      {140000, 0, 100}, {140000, 10, 2}, {140000, 50, 10}, {140000, 100, 5}};
  EXPECT_THAT(components_of(runs, 0.0), testing::ElementsAre(0, 0, 0, 1));
  EXPECT_THAT(components_of(runs, 1.0), testing::ElementsAre(0, 0, 0, 0));
}

TEST(GroundTies, DoNotReachIntoAnotherWorld) {
  const std::vector<CellRun> runs = {{140000, 1000, 50}};
  const std::vector<GroundSeen> grounds = {{.ground = "earth", .within_m = 1e3, .runs = runs},
                                           {.ground = "aaaa", .within_m = 1e3, .runs = runs},
                                           {.ground = "earth", .within_m = 1e3, .runs = runs},
                                           {.ground = "bbbb", .within_m = 1e3, .runs = runs},
                                           {.ground = "earth", .within_m = 1e3, .runs = {}}};
  const GroundTies ties = tie_grounds(pointers(grounds), 5000.0);
  EXPECT_THAT(ties.components, testing::ElementsAre(0, 1, 0, 2, 3));
  EXPECT_THAT(ties.ties, testing::ElementsAre(GroundTie{0, 2, true}));
}

}  // namespace
}  // namespace terracast::batch
