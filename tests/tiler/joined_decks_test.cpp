#include "tiler/roads/joined_decks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
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

/// As they would be built alone (joined: none), or joined; with all their marks, or without those
/// that would lie on others.
std::vector<world_check::Coincident> coincident(const std::vector<Deck>& decks,
                                                const tiler::JoinedDecks* joined,
                                                bool has_all_marks = false) {
  const geo::WorldFrame frame({.lat_deg = 43.74, .lon_deg = 7.42, .height_m = 0.0});
  tiler::DeckSite site{.frame = frame,
                       .ground_level_m = [](const Vector2d&) { return 0.0; },
                       .is_water = [](const Vector2d&) { return false; },
                       .is_taken = [](const Vector2d&, double) { return false; }};
  std::vector<world::Solid> solids;
  for (std::size_t row = 0; row < decks.size(); ++row) {
    if (joined != nullptr && !has_all_marks)
      site.is_without_marks = [joined, row](const Vector2d& at, double level_m) {
        return joined->is_without_marks(row, at, level_m);
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

// Seen in November 2026 in Monaco (ways 92627405 and 156242241): a slip road's bridge joins a wider
// one at a small angle, and lines of both lay in one plane.
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

/// All decks at one place: pairs are counted, not timed.
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

/// Two long bridges beside each other, whose boxes meet all along: segments are counted, not timed.
TEST(JoinedDecks, ThatAreLongAreHeldAgainstWhatIsNear) {
  constexpr int kNum = 50'000;
  std::vector<Deck> decks(2);
  for (int row = 0; row < 2; ++row) {
    Deck& deck = decks[static_cast<std::size_t>(row)];
    deck.feature = deck.key = static_cast<std::uint64_t>(row);
    deck.style.half_width_m = 4.0;
    for (int k = 0; k < kNum; ++k) {
      const double along_m = 0.5 * k;
      const Vector2d at(0.8 * along_m, 0.6 * along_m + 20.0 * row + 3.0 * std::sin(0.01 * k));
      deck.points.push_back({at, {0.8, 0.6}, along_m, 20.0});
    }
  }
  const tiler::JoinedDecks apart(decks);
  EXPECT_EQ(apart.num_pairs(), 1);
  // They are 16 m apart, farther than boxes reach that hold a place and half its width.
  EXPECT_EQ(apart.num_segments(), 0);
  EXPECT_FALSE(apart.is_without_marks(1, decks[1].points[70].at_world, 20.0));
  EXPECT_EQ(apart.lowered(1).points[0].level_m, 20.0);
  // At other levels, over each other all along: of three places for each metre, to either side,
  // each meets the segments within its box of 10.4 m, which are 0.5 m long.
  for (tiler::DeckPoint& point : decks[1].points) {
    point.at_world.y() -= 20.0;
    point.level_m = 12.0;
  }
  const tiler::JoinedDecks over(decks);
  EXPECT_LT(over.num_segments(), 2LL * kNum * 2 * 3 * 30);
  EXPECT_GT(over.num_segments(), kNum);
  EXPECT_EQ(over.lowered(1).feet_lowered_m, tiler::JoinedDecks::kLower_m);
  EXPECT_EQ(over.num_tangled(), 0);
}

/// A line that goes to and fro across a square.
Deck scribble(std::uint64_t key, const Vector2d& corner, double level_m, int num_points) {
  constexpr double kSide_m = 40.0;
  Deck made;
  made.feature = made.key = key;
  made.style.half_width_m = 2.0;
  made.style.num_lanes = 2;
  made.style.marking = world::Marking::Lanes;
  for (int k = 0; k < num_points; ++k) {
    const double aside_m = 2.0 * k / num_points;
    const Vector2d at =
        corner + (k % 2 == 0 ? Vector2d(aside_m, 0.0) : Vector2d(kSide_m + aside_m, kSide_m));
    const double along_m =
        k == 0 ? 0.0 : made.points.back().along_m + (at - made.points.back().at_world).norm();
    made.points.push_back({at, {0.6, 0.8}, along_m, level_m});
  }
  return made;
}

/// Scribbles whose boxes all lie over each other: segments are counted, not timed. To hold each place
/// against each segment would be hundreds of millions of them.
TEST(JoinedDecks, ThatAreScribbledAreTakenToLieOnEachOther) {
  constexpr int kNum = 2000;
  // Side by side, 20 m apart; over each other, far apart.
  for (const auto& [aside_m, level_m] : {std::pair(28.0, 20.0), std::pair(0.0, 12.0)}) {
    const std::vector<Deck> decks = {scribble(1, {0, 0}, 20.0, kNum),
                                     scribble(2, {aside_m, 0}, level_m, kNum)};
    const tiler::JoinedDecks joined(decks);
    EXPECT_LE(joined.num_segments(), 1'000'000) << aside_m;
    EXPECT_EQ(joined.num_tangled(), 1) << aside_m;
    EXPECT_NEAR(decks[1].points[0].level_m - joined.lowered(1).points[0].level_m,
                tiler::JoinedDecks::kLower_m, 1e-9);
    EXPECT_EQ(joined.lowered(0).points[0].level_m, 20.0);
    EXPECT_TRUE(joined.is_without_marks(1, {30.0, 20.0}, level_m));
    EXPECT_FALSE(joined.is_without_marks(0, {30.0, 20.0}, 20.0));
  }
  // What is near a few of them is not.
  const std::vector<Deck> decks = {scribble(1, {0, 0}, 20.0, 400), scribble(2, {28, 0}, 20.0, 400)};
  const tiler::JoinedDecks joined(decks);
  EXPECT_EQ(joined.num_tangled(), 0);
  EXPECT_EQ(joined.lowered(1).points[0].level_m, 20.0);
  EXPECT_FALSE(joined.is_without_marks(1, {30.0, 20.0}, 20.0));
}

// Seen in November 2026 in Alpine (E -2885 N -8736): supports of a bridge stood where one below it
// has its own, and the feet of both ended equally deep in the ground.
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

// Seen in November 2026 in Alpine (E -16085 N -9962): a railway's bridge crosses a road's at its
// level, and tops of sleepers lay in the plane of the road.
TEST(JoinedDecks, HaveNoSleepersOnARoad) {
  std::vector<Deck> decks = {deck(1, 2.2, {0, 0}, {120, 0}, 20.0, 20.0),
                             deck(2, 5.0, {60, -60}, {60, 60}, 20.04, 20.04)};
  decks[0].style.use = tiler::WayUse::Railway;
  decks[0].style.num_lanes = 1;
  const tiler::JoinedDecks joined(decks);
  // The railway lies 2 cm lower: its sleepers would end 5 cm above 20 m, as the road's deck.
  EXPECT_EQ(coincident(decks, &joined, true).size(), 1U);
  EXPECT_TRUE(coincident(decks, &joined).empty());
  EXPECT_NEAR(joined.lowered(0).points[0].level_m, 19.98, 1e-9);
}

// Seen in November 2026 in Alpine (E 2848 N -6375): a road's line in the plane of a railway's deck
// that climbs through it.
TEST(JoinedDecks, HaveNoLinesWhereRailsCross) {
  // Tops of lines lie 6 mm above tops of decks, and the narrower deck is 2 cm lower: the railway,
  // of 0.5 %, comes through the line that is 0.31 m within the road's eastern side.
  for (const auto& [road_half_width_m, rails_level_m] :
       {std::pair(5.0, 20.026), std::pair(1.8, 19.986)}) {
    const double middle_m = rails_level_m - 0.005 * (road_half_width_m - 0.31);
    std::vector<Deck> decks = {deck(1, 2.2, {0, 0}, {120, 0}, middle_m - 0.3, middle_m + 0.3),
                               deck(2, road_half_width_m, {60, -60}, {60, 60}, 20.0, 20.0)};
    decks[0].style.use = tiler::WayUse::Railway;
    decks[0].style.num_lanes = 1;
    const tiler::JoinedDecks joined(decks);
    EXPECT_TRUE(joined.is_without_marks(1, {60, 0}, 20.0)) << road_half_width_m;
    EXPECT_TRUE(joined.is_without_marks(0, {60, 0}, 20.0)) << road_half_width_m;
    EXPECT_FALSE(joined.is_without_marks(1, {60, 10}, 20.0));
    EXPECT_FALSE(joined.is_without_marks(0, {50, 0}, 19.8));
    EXPECT_EQ(coincident(decks, &joined, true).size(), 1U) << road_half_width_m;
    EXPECT_TRUE(coincident(decks, &joined).empty()) << road_half_width_m;
  }
}

/// Trams on a road's bridge: the road keeps its lines, as beside any other deck that lies lower.
TEST(JoinedDecks, BearLinesWhereRailsRunAlong) {
  for (const double angle_deg : {0.0, 3.0, 7.0, 90.0, 173.0, 177.0}) {
    const double angle_rad = angle_deg / 180.0 * std::numbers::pi;
    const Vector2d half = 60.0 * Vector2d(std::cos(angle_rad), std::sin(angle_rad));
    std::vector<Deck> decks = {deck(1, 1.5, -half, half, 20.0, 20.0),
                               deck(2, 6.0, {-100, 0}, {100, 0}, 20.0, 20.0)};
    decks[0].style.use = tiler::WayUse::Railway;
    const tiler::JoinedDecks joined(decks);
    EXPECT_EQ(joined.is_without_marks(1, {0, 0}, 20.0),
              angle_deg == 7.0 || angle_deg == 90.0 || angle_deg == 173.0)
        << angle_deg;
    EXPECT_TRUE(joined.is_without_marks(0, {0, 0}, 20.0)) << angle_deg;
    // Of tracks of another road's width: no crossing either.
    decks[0].style.use = tiler::WayUse::Road;
    EXPECT_FALSE(tiler::JoinedDecks(decks).is_without_marks(1, {0, 0}, 20.0)) << angle_deg;
  }
}

TEST(JoinedDecks, ThatManyRailsCrossRememberTheFirst) {
  constexpr int kMost = tiler::JoinedDecks::kMostMet;
  std::vector<Deck> decks = {deck(1, 5.0, {-1000, 0}, {1000, 0}, 20.0, 20.0)};
  for (int k = 0; k < kMost + 40; ++k) {
    const double east_m = -900.0 + 6.0 * k;
    decks.push_back(
        deck(static_cast<std::uint64_t>(2 + k), 1.5, {east_m, -20}, {east_m, 20}, 20.0, 20.0));
    decks.back().style.use = tiler::WayUse::Railway;
  }
  const tiler::JoinedDecks joined(decks);
  for (int k = 0; k < kMost + 40; ++k) {
    EXPECT_EQ(joined.is_without_marks(0, {-900.0 + 6.0 * k, 0}, 20.0), k < kMost) << k;
    EXPECT_TRUE(
        joined.is_without_marks(static_cast<std::size_t>(1 + k), {-900.0 + 6.0 * k, 0}, 20.0));
  }
}

TEST(JoinedDecks, BearLinesOnTheWiderOneAlone) {
  const std::vector<Deck> decks = {deck(1, 2.5, {0, 0}, {100, 0}, 20.0, 20.0),
                                   deck(2, 4.0, {100, 50}, {40, -50}, 20.0, 20.0)};
  const tiler::JoinedDecks joined(decks);
  // They cross at E 70; lines end 0.3 m from the wider one, which is 4 m wide to either side.
  for (double x = 0.5; x < 100.0; x += 1.0) {
    const double beside_m = std::abs(x - 70.0) * 100.0 / std::hypot(100.0, 60.0);
    EXPECT_EQ(joined.is_without_marks(0, {x, 0.0}, 20.0), beside_m <= 4.3) << x;
    EXPECT_FALSE(joined.is_without_marks(0, {x, 0.0}, 21.0));
    EXPECT_FALSE(joined.is_without_marks(1, {x, 0.0}, 20.0));
  }
}

}  // namespace
}  // namespace terracast::test
