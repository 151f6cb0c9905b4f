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

// Seen in November 2026 in Monaco (ways 92627405 and 156242241): a slip road's bridge joins a wider one at a small angle,
// and lines of both lay in one plane.
TEST(JoinedDecks, HaveNoFacesInOnePlane) {
  const geo::WorldFrame frame({.lat_deg = 43.74, .lon_deg = 7.42, .height_m = 0.0});
  const std::vector<Deck> decks = {
      deck(1, 4.0, {0, 0}, {120, 0}, 20.0, 20.0),
      deck(2, 2.5, {20, -12}, {110, 0}, 20.0, 20.0),   // at 8 degrees
      deck(3, 4.0, {120, 0}, {180, 10}, 20.0, 20.0),   // goes on
      deck(4, 4.0, {60, -60}, {60, 60}, 12.0, 12.0)};  // far below the first
  const tiler::JoinedDecks joined(decks);
  const auto coincident = [&](bool is_joined) {
    tiler::DeckSite site{.frame = frame,
                         .ground_level_m = [](const Vector2d&) { return 0.0; },
                         .is_water = [](const Vector2d&) { return false; },
                         .is_taken = [](const Vector2d&, double) { return false; }};
    std::vector<world::Solid> solids;
    for (std::size_t row = 0; row < decks.size(); ++row) {
      if (is_joined)
        site.has_other_lines = [&joined, row](const Vector2d& at, double level_m) {
          return joined.other_bears_lines(row, at, level_m);
        };
      solids.push_back(tiler::build_deck(is_joined ? joined.lowered(row) : decks[row], site));
    }
    std::vector<world_check::ShownSolid> shown;
    for (std::size_t row = 0; row < solids.size(); ++row)
      shown.push_back({static_cast<std::uint32_t>(row + 1), solids[row].origin_steps,
                       &solids[row].levels.front().shape});
    return world_check::find_coincident(shown);
  };
  EXPECT_EQ(coincident(false).size(), 2U);  // the first with the second and the third
  for (const world_check::Coincident& pair : coincident(true))
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
