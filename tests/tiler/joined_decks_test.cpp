#include "tiler/roads/joined_decks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "validate/world_check/coincident_solids.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using tiler::Deck;

Deck deck(std::uint64_t key, double half_width_m, const Vector2d& from, const Vector2d& to,
          double from_level_m, double to_level_m) {
  Deck made;
  made.feature = made.key = key;
  made.style.half_width_m = half_width_m;
  made.style.num_lanes = 2;
  made.style.marking = world::Marking::Lanes;
  const Vector2d tangent = (to - from).normalized();
  const double length_m = (to - from).norm();
  for (int k = 0; k <= 8; ++k)
    made.points.push_back({from + k / 8.0 * (to - from), tangent, length_m * k / 8.0,
                           from_level_m + k / 8.0 * (to_level_m - from_level_m)});
  return made;
}

/// As they would be built alone (joined: none), or joined.
std::vector<world_check::Coincident> coincident(const std::vector<Deck>& decks,
                                                const tiler::JoinedDecks* joined) {
  const geo::WorldFrame frame({.lat_deg = 43.74, .lon_deg = 7.42, .height_m = 0.0});
  tiler::DeckSite site{.frame = frame,
                       .ground_level_m = [](const Vector2d&) { return 0.0; },
                       .is_water = [](const Vector2d&) { return false; },
                       .is_taken = [](const Vector2d&, double) { return false; }};
  std::vector<world::Solid> solids;
  for (std::size_t row = 0; row < decks.size(); ++row) {
    if (joined != nullptr)
      site.has_other_lines = [joined, row](const Vector2d& at, double level_m) {
        return joined->other_bears_lines(row, at, level_m);
      };
    solids.push_back(
        tiler::build_deck(joined != nullptr ? joined->lowered(row) : decks[row], site));
  }
  std::vector<world_check::ShownSolid> shown;
  for (std::size_t row = 0; row < solids.size(); ++row)
    shown.push_back({static_cast<std::uint32_t>(row + 1), solids[row].origin_steps,
                     &solids[row].levels.front().shape});
  return world_check::find_coincident(shown);
}

// Seen in November 2026 in Monaco (ways 92627405 and 156242241): a slip road's bridge joins a wider one at a small angle,
// and lines of both lay in one plane.
TEST(JoinedDecks, HaveNoFacesInOnePlane) {
  const std::vector<Deck> decks = {
      deck(1, 4.0, {0, 0}, {120, 0}, 20.0, 20.0),
      deck(2, 2.5, {20, -12}, {110, 0}, 20.0, 20.0),   // at 8 degrees
      deck(3, 4.0, {120, 0}, {180, 10}, 20.0, 20.0),   // goes on
      deck(4, 4.0, {60, -60}, {60, 60}, 12.0, 12.0)};  // far below the first
  const tiler::JoinedDecks joined(decks);
  EXPECT_EQ(coincident(decks, nullptr).size(), 2U);  // the first with the second and the third
  for (const world_check::Coincident& pair : coincident(decks, &joined))
    ADD_FAILURE() << decks[pair.first].key << " and " << decks[pair.second].key << ": "
                  << pair.area_m2 << " m2";
  const auto lowered_m = [&](std::size_t row) {
    return decks[row].points[0].level_m - joined.lowered(row).points[0].level_m;
  };
  EXPECT_EQ(lowered_m(0), 0.0);
  EXPECT_NEAR(lowered_m(1), 0.020, 1e-9);
  EXPECT_NEAR(lowered_m(2), 0.020, 1e-9);  // does not lie on the second one
  EXPECT_EQ(lowered_m(3), 0.0);
}

/// The most work that files can ask for: all decks at one place. Counted, not timed.
TEST(JoinedDecks, ThatCrowdAreLookedAtUpToABound) {
  constexpr int kNum = 3000;
  constexpr int kMost = tiler::JoinedDecks::kMostMet;
  std::vector<Deck> decks;
  for (int k = 0; k < kNum; ++k)
    decks.push_back(deck(static_cast<std::uint64_t>(kNum - k), 2.0, {0, 0}, {4, 0}, 20.0, 20.0));
  const tiler::JoinedDecks joined(decks);
  // A deck meets those that go before it, and stops at the first beyond the bound.
  std::int64_t num_pairs = 0;
  for (int k = 0; k < kNum; ++k) num_pairs += std::min(k, kMost + 1);
  EXPECT_EQ(joined.num_pairs(), num_pairs);
  // Those with the lowest keys go before all others.
  const auto lowered_m = [&](int num_before) {
    const auto row = static_cast<std::size_t>(kNum - 1 - num_before);
    return decks[row].points[0].level_m - joined.lowered(row).points[0].level_m;
  };
  for (int k = 0; k <= tiler::JoinedDecks::kMostRank; ++k)
    EXPECT_NEAR(lowered_m(k), k * tiler::JoinedDecks::kLower_m, 1e-9) << k;
  EXPECT_NEAR(lowered_m(kNum - 1), tiler::JoinedDecks::kMostRank * tiler::JoinedDecks::kLower_m,
              1e-9);
}

// Seen in November 2026 in Alpine (E -2885 N -8736): supports of a bridge stood where one below it has its own, and the feet of
// both ended equally deep in the ground.
TEST(JoinedDecks, HaveFeetOfTheirOwnDepths) {
  // Supports stand each 24 m: both have one at E 72 N 0.
  const std::vector<Deck> decks = {deck(1, 4.0, {0, 0}, {120, 0}, 20.0, 20.0),
                                   deck(2, 4.0, {72, -48}, {72, 72}, 12.0, 12.0)};
  const tiler::JoinedDecks joined(decks);
  const auto alone = coincident(decks, nullptr);
  ASSERT_EQ(alone.size(), 1U);
  EXPECT_NEAR(alone[0].area_m2, 1.2 * 1.2, 0.01);  // as wide as both are along their bridges
  EXPECT_TRUE(coincident(decks, &joined).empty());
  // Their tops are as they were.
  for (const std::size_t row : {0, 1})
    EXPECT_EQ(joined.lowered(row).points[0].level_m, decks[row].points[0].level_m);
}

// Seen in November 2026 in Alpine (E -16085 N -9962): a railway's bridge crosses a road's at its level, and tops of sleepers lay
// in the plane of the road.
TEST(JoinedDecks, HaveNoSleepersOnARoad) {
  std::vector<Deck> decks = {deck(1, 2.2, {0, 0}, {120, 0}, 20.0, 20.0),
                             deck(2, 5.0, {60, -60}, {60, 60}, 20.04, 20.04)};
  decks[0].style.use = tiler::WayUse::Railway;
  decks[0].style.num_lanes = 1;
  const tiler::JoinedDecks joined(decks);
  // The railway lies 2 cm lower: its sleepers would end 5 cm above 20 m, as the road's deck.
  EXPECT_TRUE(coincident(decks, &joined).empty());
  EXPECT_NEAR(joined.lowered(0).points[0].level_m, 19.98, 1e-9);
}

// Seen in November 2026 in Alpine (E 2848 N -6375): a road's line in the plane of a railway's deck that climbs through it.
TEST(JoinedDecks, HaveNoLinesWhereRailsCross) {
  for (const double road_half_width_m : {5.0, 1.8}) {
    std::vector<Deck> decks = {deck(1, 2.2, {0, 0}, {120, 0}, 18.8, 21.2),
                               deck(2, road_half_width_m, {60, -60}, {60, 60}, 20.0, 20.0)};
    decks[0].style.use = tiler::WayUse::Railway;
    decks[0].style.num_lanes = 1;
    const tiler::JoinedDecks joined(decks);
    EXPECT_TRUE(joined.other_bears_lines(1, {60, 0}, 20.0)) << road_half_width_m;
    EXPECT_TRUE(joined.other_bears_lines(0, {60, 0}, 20.0)) << road_half_width_m;
    EXPECT_FALSE(joined.other_bears_lines(1, {60, 10}, 20.0));
    EXPECT_FALSE(joined.other_bears_lines(0, {50, 0}, 19.8));
  }
}

TEST(JoinedDecks, BearLinesOnTheWiderOneAlone) {
  const std::vector<Deck> decks = {deck(1, 2.5, {0, 0}, {100, 0}, 20.0, 20.0),
                                   deck(2, 4.0, {100, 50}, {40, -50}, 20.0, 20.0)};
  const tiler::JoinedDecks joined(decks);
  // They cross at E 70; lines end 0.3 m from the wider one, which is 4 m wide to either side.
  for (double x = 0.5; x < 100.0; x += 1.0) {
    const double beside_m = std::abs(x - 70.0) * 100.0 / std::hypot(100.0, 60.0);
    EXPECT_EQ(joined.other_bears_lines(0, {x, 0.0}, 20.0), beside_m <= 4.3) << x;
    EXPECT_FALSE(joined.other_bears_lines(0, {x, 0.0}, 21.0));
    EXPECT_FALSE(joined.other_bears_lines(1, {x, 0.0}, 20.0));
  }
}

}  // namespace
}  // namespace terracast::test
