#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "job/traffic/encounters.h"
#include "job/traffic/lane_path.h"
#include "job/traffic/proposals.h"
#include "tests/support/traffic_town.h"

namespace terracast::job {
namespace {

using namespace test;

/// Stands at a place.
class Still final : public Traveller {
 public:
  Still(std::uint64_t key, const Footprint& footprint) : key_(key), footprint_(footprint) {}
  std::uint64_t key() const override { return key_; }
  Footprint at(double) const override { return footprint_; }

 private:
  std::uint64_t key_;
  Footprint footprint_;
};

TEST(Encounters, LargeThingsAreInTheWayAsFarAsTheyReach) {
  // An airliner of 70 m by 65 m, turned; cars on a grid about it. They meet by the four axes of two boxes, whose room
  // is 1 m along and 0.12 m aside: here by the corners of the car in the airliner's frame, the car much the smaller.
  constexpr double kTurned_rad = 0.4;
  Obstacle airliner{.states = {geo::BodyState{}}, .length_m = 70.0, .width_m = 65.0};
  airliner.states[0]->world_from_body.rotation = Eigen::AngleAxisd(kTurned_rad, Vector3d::UnitZ());
  std::vector<Still> cars;
  for (int j = -30; j <= 30; ++j)
    for (int i = -30; i <= 30; ++i)
      cars.emplace_back(static_cast<std::uint64_t>(cars.size()),
                        Footprint{.at_world = Vector2d(2.5 * i, 2.5 * j),
                                  .forward = {std::cos(kTurned_rad), std::sin(kTurned_rad)},
                                  .length_m = 4.0,
                                  .width_m = 1.8});
  int num_in = 0, num_far = 0;
  for (const Still& car : cars) {
    const Traveller* one = &car;
    const Encounters found = find_encounters({&one, 1}, {&airliner, 1}, {}, 0.0);
    const Vector2d in = Eigen::Rotation2Dd(-kTurned_rad) * car.at(0.0).at_world;
    const bool meets = std::abs(in.x()) <= 35.0 + 2.0 + 2.0 * kRoomAlong_m &&
                       std::abs(in.y()) <= 32.5 + 0.9 + 2.0 * kRoomAside_m;
    EXPECT_EQ(found.is_blocked[0] != 0, meets) << in.transpose();
    num_in += meets ? 1 : 0;
    num_far += meets && in.norm() > 40.0 ? 1 : 0;
  }
  EXPECT_GT(num_in, 500);
  EXPECT_GT(num_far, 10);
}

TEST(Encounters, ALampTakesItsFootAloneWhateverItPointsAt) {
  const Footprint walker{.at_world = {0.0, 0.0}, .length_m = 0.4, .width_m = 0.5};
  for (const double turned_rad : {0.0, 0.5 * 3.14159265358979}) {
    Footprint lamp{.forward = {std::cos(turned_rad), std::sin(turned_rad)},
                   .length_m = 0.25,
                   .width_m = 0.25,
                   .room_along_m = kRoomAside_m};
    // Beside: half of both, and 0.12 m of room of each.
    lamp.at_world = {0.0, 0.125 + 0.25 + 2.0 * 0.12 + 0.01};
    EXPECT_FALSE(meet(walker, lamp));
    lamp.at_world.y() -= 0.02;
    EXPECT_TRUE(meet(walker, lamp));
  }
}

/// A road from south to north over a bridge's end, from which the bridge leads east and over another road.
Town abutment() {
  Town town;
  town.add(WayKind::Primary, {{0, -700}, {0, 0}}, 3.5, 2);
  town.add(WayKind::Primary, {{0, 0}, {0, 700}}, 3.5, 2);
  WayPart& bridge = town.add(WayKind::Primary, {{0, 0}, {200, 0}}, 3.5, 2);
  bridge.is_bridge = true;
  for (auto& point : bridge.points_steps) point.z() = steps(8.0);
  town.add(WayKind::Primary, {{200, 0}, {900, 0}}, 3.5, 2);
  town.add(WayKind::Primary, {{100, -700}, {100, 700}}, 3.5, 2);
  return town;
}

TEST(Traffic, CarsDoNotMeetWhereABridgeEndsAtAJunction) {
  const Town town = abutment();
  int num_at_end = 0, num_over = 0, num_on_deck_of_all = 0;
  for (int seed = 1; seed <= 12; ++seed) {
    const auto things = traffic_of(
        town.network, fmt::format("amount = 8.0\nreach_m = 300.0\nmost = 1000\nseed = {}\n", seed),
        frames_at(10.0, 101, {50, 0}));
    ASSERT_GT(things.size(), 5U);
    const auto is_on_bridge = [](const Vector2d& at) { return at.x() > 12.0 && at.x() < 188.0; };
    for (std::size_t frame = 0; frame < things[0].states.size(); ++frame)
      for (const MovingThing& one : things)
        for (const MovingThing& other : things) {
          if (&one == &other) continue;
          const Vector2d at = place_of(*one.states[frame]), to = place_of(*other.states[frame]);
          // One below the bridge's middle, by the way on which it is, is not on it.
          const bool is_below =
              std::abs(at.x() - 100.0) < 4.0 && std::abs(forward_of(*one.states[frame]).y()) > 0.9;
          const bool is_over = std::abs(to.y()) < 4.0 && is_on_bridge(to);
          num_on_deck_of_all += is_over ? 1 : 0;
          if (!boxes_overlap(one, other, frame)) {
            num_at_end += at.norm() < 8.0 ? 1 : 0;
            continue;
          }
          const bool other_is_below = std::abs(to.x() - 100.0) < 4.0 &&
                                      std::abs(forward_of(*other.states[frame]).y()) > 0.9;
          ASSERT_TRUE(is_below != other_is_below)
              << seed << " " << one.name << " and " << other.name << " at " << at.transpose();
          ++num_over;
        }
  }
  EXPECT_GT(num_at_end, 100) << "some go over the junction";
  EXPECT_GT(num_on_deck_of_all, 100);
  EXPECT_GT(num_over, 0) << "what is on the bridge does not hinder who goes below it";
}

/// A straight road of equal parts.
Town in_parts(double part_m, int num) {
  Town town;
  for (int i = 0; i < num; ++i)
    town.add(WayKind::Primary,
             {{(i - 0.5 * num) * part_m, 0.0}, {(i + 1 - 0.5 * num) * part_m, 0.0}}, 4.0, 2);
  return town;
}

TEST(Traffic, OverShortPartsAsManyAreProposedAsOnOneLong) {
  // 8 on a lane's km, by `amount`; nobody on a part's first 4 m. The number on a part is stationary, so that its mean
  // is exact; it deviates by less than Poisson's.
  for (const double part_m : {30.0, 100.0, 250.0})
    for (const double amount : {1.0, 2.0, 20.0}) {
      const int num = static_cast<int>(60000.0 / part_m);
      const WayGraph ways(in_parts(part_m, num).network);
      const std::vector<TrafficOptions> options = {
          options_of(fmt::format("amount = {}\nreach_m = 5000.0\n", amount))};
      std::vector<geo::BodyState> frames;
      for (double x = -30000.0; x <= 30000.0; x += 4000.0) {
        frames.emplace_back();
        frames.back().world_from_body.translation = {x, 0.0, 0.0};
      }
      const auto proposals = propose(options, frames, 1.0, ways);
      const double least_m = 1.5 * 80.0 / 3.6 + 7.0;
      const double mean_m = std::max(1000.0 / (8.0 * amount), 1.1 * least_m);
      const double expected = 2.0 * num * (part_m - 4.0) / mean_m;
      EXPECT_NEAR(static_cast<double>(proposals.size()), expected, 3.5 * std::sqrt(expected))
          << part_m << " " << amount;
    }
}

TEST(Traffic, HeadwaysHoldFromPartToPart) {
  const double speed_mps = 80.0 / 3.6;
  const Town town = in_parts(100.0, 120);
  for (const double amount : {1.0, 2.0}) {
    const auto frames = frames_at(2.0, 21, {0, 0});
    const auto things = traffic_of(
        town.network, fmt::format("amount = {}\nreach_m = 1500.0\nmost = 5000\n", amount), frames);
    std::map<int, std::set<double>> lanes;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      lanes.clear();
      for (const MovingThing& thing : things)
        lanes[forward_of(*thing.states[i]).x() > 0.0 ? 1 : -1].insert(
            place_of(*thing.states[i]).x());
      ASSERT_EQ(lanes.size(), 2U);
      for (const auto& [direction, places] : lanes)
        for (auto at = places.begin(), next = std::next(at); next != places.end(); ++at, ++next)
          ASSERT_GE(*next - *at, 1.5 * speed_mps - 1e-6) << "all go at one speed";
    }
    // Of those asked for on 2 x 3 km and what they come from in 10 s, few have to give way: two of neighbouring parts
    // that are drawn nearer than 33 m.
    double num = 0.0;
    for (const MovingThing& thing : things)
      num += std::abs(place_of(*thing.states[10]).x()) < 1400.0 ? 1.0 : 0.0;
    const double asked = 2.0 * 2800.0 / 1000.0 * 8.0 * amount;
    const double density_per_m = 8.0 * amount / 1000.0, near_m = 1.5 * speed_mps;
    const double share_lost = 0.04 + 0.5 * density_per_m * near_m * near_m / 100.0;
    EXPECT_GT(num, asked * (1.0 - share_lost) - 3.5 * std::sqrt(asked));
    EXPECT_LT(num, asked + 3.5 * std::sqrt(asked));
  }
}

}  // namespace
}  // namespace terracast::job
