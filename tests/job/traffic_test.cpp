#include "job/traffic/traffic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/semantic_class.h"
#include "job/traffic/drive.h"
#include "job/traffic/lane_path.h"
#include "tests/support/expect_error.h"
#include "tests/support/traffic_town.h"

namespace terracast::job {
namespace {

using namespace test;

TEST(Traffic, KeepsToLanesInTheRightDirectionAndNeverMeets) {
  const Town town = checkerboard();
  for (const bool on_left : {false, true}) {
    SCOPED_TRACE(on_left);
    const auto things =
        traffic_of(town.network, std::string(kBusy) + (on_left ? "drives_on_left = true\n" : ""),
                   frames_at(6.7, 68));
    ASSERT_GT(things.size(), 100U);
    std::map<WayKind, int> num_seen;
    int num_turned = 0;
    for (const MovingThing& thing : things) {
      EXPECT_EQ(thing.ride, scene::Ride::Way);
      for (const auto& state : thing.states) {
        ASSERT_TRUE(state) << "nothing comes or goes";
        const Nearest way = nearest(town.network, place_of(*state), true);
        const double half_m = way.part->half_width_steps * kHeightStep_m;
        if (way.to_node_m < 16.0) {  // on a curve from one way into another
          EXPECT_LT(way.outside_m, 0.2) << thing.name;
          continue;
        }
        ++num_seen[way.part->kind];
        // All of it on the paving, at the side on which one drives.
        EXPECT_LE(way.distance_m + 0.5 * size_of(thing).y(), half_m + 0.15) << thing.name;
        const bool is_forward = forward_of(*state).dot(way.direction) > 0.0;
        EXPECT_TRUE(is_forward ? way.part->may_go_forward : way.part->may_go_backward);
        EXPECT_GT(std::abs(forward_of(*state).dot(way.direction)), 0.95);
        if (way.part->num_lanes > 1) {
          EXPECT_GT((is_forward != on_left ? -way.left_m : way.left_m), 1.0) << thing.name;
        }
      }
      if (forward_of(*thing.states.front()).dot(forward_of(*thing.states.back())) < 0.5)
        ++num_turned;
    }
    EXPECT_GT(num_seen[WayKind::Primary], 1000);
    EXPECT_GT(num_seen[WayKind::Tertiary], 1000);
    EXPECT_GT(num_seen[WayKind::Residential], 100);
    EXPECT_GT(num_turned, 5);
    expect_nothing_meets(things);
  }
}

TEST(Traffic, MovesAsItsStatesSayNoFasterThanIsAllowed) {
  const Town town = checkerboard();
  constexpr double kRate_hz = 500.0;  // states next to each other are differences
  std::vector<geo::BodyState> frames = frames_at(kRate_hz, 4001);
  const auto things =
      traffic_of(town.network, "amount = 1.0\nreach_m = 300.0\nspeed = 0.9\n", frames);
  ASSERT_GT(things.size(), 20U);
  double fastest = 0.0;
  for (const MovingThing& thing : things)
    for (std::size_t i = 1; i + 1 < frames.size(); i += 37) {
      const geo::BodyState& before = *thing.states[i - 1];
      const geo::BodyState& here = *thing.states[i];
      const geo::BodyState& after = *thing.states[i + 1];
      const Vector2d velocity = (place_of(after) - place_of(before)) * (0.5 * kRate_hz);
      EXPECT_LT((velocity - here.velocity_world_mps.head<2>()).norm(), 0.01);
      // Central differences err by the third derivative at joints of the curve: some m/s^3 over 2 ms.
      const Vector2d acceleration =
          (after.velocity_world_mps - before.velocity_world_mps).head<2>() * (0.5 * kRate_hz);
      EXPECT_LT((acceleration - here.acceleration_world_mps2.head<2>()).norm(), 0.9);
      EXPECT_NEAR(velocity.dot(forward_of(here)), velocity.norm(), 1e-4);
      const double turning =
          std::asin(std::clamp(forward_of(before).x() * forward_of(after).y() -
                                   forward_of(before).y() * forward_of(after).x(),
                               -1.0, 1.0)) *
          0.5 * kRate_hz;
      EXPECT_NEAR(turning, here.angular_velocity_body_radps.z(), 0.05);
      // Bends: 2 m/s^2; along: 1.2 and 1.8.
      EXPECT_LT(std::abs(velocity.norm() * turning), 2.0 + 0.1);
      EXPECT_LT(std::abs(acceleration.dot(forward_of(here))), 1.8 + 0.1);
      const Nearest way = nearest(town.network, place_of(here), true);
      const double limit_kmph = way.part->kind == WayKind::Tertiary      ? 40.0
                                : way.part->kind == WayKind::Residential ? 30.0
                                                                         : 50.0;
      if (way.to_node_m > 16.0) {
        EXPECT_LE(velocity.norm(), 0.9 * limit_kmph / 3.6 + 1e-3);
      }
      fastest = std::max(fastest, velocity.norm());
      EXPECT_NEAR((thing.gone_m[i + 1] - thing.gone_m[i - 1]) * 0.5 * kRate_hz, velocity.norm(),
                  0.01);
    }
  EXPECT_GT(fastest, 0.9 * 50.0 / 3.6 - 0.01) << "somebody goes as fast as is allowed";
}

TEST(Traffic, FollowsAtGapsAndAsDenselyAsIsAsked) {
  // One road of 30 km, with a lane each way: 8 vehicles on a lane's km of a primary road, by 3.
  Town town;
  town.add(WayKind::Primary, {{-15000, 0}, {15000, 0}}, 4.0, 2);
  const WayGraph ways(town.network);
  const core::Log log("test", core::LogLevel::Off);
  for (const double amount : {1.0, 3.0, 20.0}) {
    SCOPED_TRACE(amount);
    std::vector<TrafficOptions> options = {
        options_of(fmt::format("amount = {}\nmost = 5000\nreach_m = 5000.0\n", amount))};
    const auto things = lay_out_traffic(
        options, frames_at(2.0, 3, {0, 0}), 1.0,
        {.ways = ways, .half_size_m = 20000.0, .obstacles = {}, .standing = {}}, log);
    std::map<int, std::vector<const MovingThing*>> lanes;
    for (const MovingThing& thing : things)
      lanes[forward_of(*thing.states[0]).x() > 0.0 ? 1 : -1].push_back(&thing);
    // 80 km/h: 1.5 s and 7 m at least from middle to middle; a tenth more on average is what a lane can hold.
    const double least_m = 1.5 * 80.0 / 3.6 + 7.0;
    const double mean_m = std::max(1000.0 / (8.0 * amount), 1.1 * least_m);
    for (auto& [direction, lane] : lanes) {
      std::sort(lane.begin(), lane.end(), [](const auto* a, const auto* b) {
        return place_of(*a->states[0]).x() < place_of(*b->states[0]).x();
      });
      double sum_m = 0.0;
      for (std::size_t i = 0; i + 1 < lane.size(); ++i) {
        const double gap_m =
            place_of(*lane[i + 1]->states[2]).x() - place_of(*lane[i]->states[2]).x();
        EXPECT_GE(gap_m, least_m - 1e-6);
        sum_m += gap_m;
      }
      const auto num = static_cast<double>(lane.size() - 1);
      // Gaps deviate by as much as their mean exceeds the least one.
      EXPECT_NEAR(sum_m / num, mean_m, 3.5 * (mean_m - least_m) / std::sqrt(num));
    }
    ASSERT_EQ(lanes.size(), 2U);
  }
}

std::string text_of(const std::vector<MovingThing>& things) {
  std::string text;
  for (const MovingThing& thing : things) {
    text += fmt::format("{} {} {}", thing.name, thing.shape.thing, thing.variety);
    for (const auto& state : thing.states)
      text += fmt::format(" {:.17g} {:.17g} {:.17g}", place_of(*state).x(), place_of(*state).y(),
                          state->velocity_world_mps.x());
  }
  return text;
}

TEST(Traffic, IsTheSameWhateverTheOrderOfWaysAndTheThreads) {
  Town town = checkerboard();
  const auto frames = frames_at(5.0, 26);
  const std::string once = text_of(traffic_of(town.network, kBusy, frames));
  {
    const core::ThreadLimit limit(1);
    EXPECT_EQ(text_of(traffic_of(town.network, kBusy, frames)), once);
  }
  world::WayNetwork shuffled = town.network;
  for (std::size_t i = shuffled.parts.size() - 1; i > 0; --i)
    std::swap(shuffled.parts[i], shuffled.parts[core::random_bits(3, 5, i) % (i + 1)]);
  for (WayPart& part : shuffled.parts)
    for (std::uint32_t* node : {&part.from_node, &part.to_node})
      *node = shuffled.num_nodes - 1 - *node;
  EXPECT_EQ(text_of(traffic_of(shuffled, kBusy, frames)), once);
  EXPECT_NE(text_of(traffic_of(town.network, std::string(kBusy) + "seed = 2\n", frames)), once);
}

TEST(Traffic, SequencesOfOneDurationSeeTheSame) {
  const Town town = checkerboard();
  const std::string toml = "amount = 3.0\nreach_m = 250.0\nmost = 1000\n";
  const auto here = traffic_of(town.network, toml, frames_at(5.0, 26, {0, 0}));
  const auto there = traffic_of(town.network, toml, frames_at(10.0, 51, {150, -60}));
  std::map<std::string, const MovingThing*> known;
  for (const MovingThing& thing : here) known.emplace(thing.name, &thing);
  int num_common = 0;
  for (const MovingThing& thing : there) {
    const auto found = known.find(thing.name);
    // Whoever is near to both is in both.
    const double from_here_m = (place_of(*thing.states[0]) - Vector2d(0, 0)).norm();
    if (found == known.end()) {
      EXPECT_GT(from_here_m, 249.0);
      continue;
    }
    ++num_common;
    for (std::size_t i = 0; i < 26; ++i)
      EXPECT_LT((place_of(*thing.states[2 * i]) - place_of(*found->second->states[i])).norm(),
                1e-9);
  }
  EXPECT_GT(num_common, 20);
}

TEST(Traffic, GivesRoomToWhatElseMovesAndIsNoMoreThanWasAsked) {
  const Town town = checkerboard();
  const auto frames = frames_at(3.0, 28);
  // A car that stands across a main street, and a body that goes along another.
  Obstacle stands{.states = {}, .length_m = 4.5, .width_m = 1.8};
  Obstacle goes = stands;
  for (const geo::BodyState& frame : frames) {
    geo::BodyState state = frame;
    state.world_from_body.translation = {75.0, -300.0, 0.0};
    state.world_from_body.rotation = Eigen::AngleAxisd(1.5, Vector3d::UnitZ());
    stands.states.push_back(state);
    state.world_from_body.translation = {6.0 * frame.time_s, 150.0 - 3.4, 0.0};
    state.world_from_body.rotation = Eigen::Quaterniond::Identity();
    goes.states.push_back(state);
  }
  const auto free = traffic_of(town.network, kBusy, frames);
  const auto blocked = traffic_of(town.network, kBusy, frames, 0.0, {stands, goes});
  int num_that_would_meet = 0;
  for (const auto* things : {&free, &blocked})
    for (const MovingThing& thing : *things)
      for (const Obstacle& obstacle : {stands, goes}) {
        MovingThing other = thing;  // of a size that is known
        other.shape.thing = "hatchback";
        for (std::size_t i = 0; i < frames.size(); ++i) other.states[i] = obstacle.states[i];
        bool meets = false;
        for (std::size_t i = 0; i < frames.size(); ++i) meets |= boxes_overlap(other, thing, i);
        if (things == &free)
          num_that_would_meet += meets ? 1 : 0;
        else
          EXPECT_FALSE(meets) << thing.name;
      }
  EXPECT_GT(num_that_would_meet, 0);
  EXPECT_GT(blocked.size() + 40, free.size());
  const auto few =
      traffic_of(town.network, std::string(kBusy) + "things = [\"city_bus\"]\n", frames);
  ASSERT_FALSE(few.empty());
  for (const MovingThing& thing : few) EXPECT_EQ(thing.shape.thing, "city_bus");
  EXPECT_EQ(traffic_of(town.network, "amount = 3.0\nmost = 7\n", frames).size(), 7U);
  EXPECT_EQ(traffic_of({}, kBusy, frames).size(), 0U);
}

TEST(Traffic, PeopleWalkOnPathsAndSidewalksBothWays) {
  const Town town = checkerboard();
  const auto things =
      traffic_of(town.network, "kind = \"people\"\namount = 6.0\nmost = 1000\nreach_m = 400.0\n",
                 frames_at(2.0, 31));
  ASSERT_GT(things.size(), 60U);
  int num_on_paths = 0, num_on_sidewalks = 0, num_forward = 0, num_turned = 0;
  for (const MovingThing& thing : things) {
    EXPECT_TRUE(thing.shape.thing == "person" || thing.shape.thing == "child");
    for (const auto& state : thing.states) {
      const double speed = state->velocity_world_mps.norm();
      EXPECT_GT(speed, 0.3);
      EXPECT_LT(speed, 1.34 + 3.0 * 0.26 + 1e-9);
      const Nearest path = nearest(town.network, place_of(*state), false);
      if (path.distance_m < 1.2) {
        ++num_on_paths;
        num_forward += forward_of(*state).dot(path.direction) > 0.0 ? 1 : 0;
        continue;
      }
      // Round a block nobody crosses a carriageway.
      const Nearest road = nearest(town.network, place_of(*state), true);
      ++num_on_sidewalks;
      EXPECT_GT(road.outside_m, 0.1) << thing.name;
      EXPECT_LT(road.outside_m, 1.8 - 0.1 + (road.to_node_m < 16.0 ? 1.0 : 0.0)) << thing.name;
    }
    if (forward_of(*thing.states.front()).dot(forward_of(*thing.states.back())) < 0.5) ++num_turned;
  }
  EXPECT_GT(num_on_sidewalks, 1000);
  EXPECT_GT(num_on_paths, 100);
  EXPECT_GT(num_forward, num_on_paths / 5);
  EXPECT_LT(num_forward, num_on_paths * 4 / 5);
  EXPECT_GT(num_turned, 0);
  expect_nothing_meets(things);
}

TEST(Traffic, WhatCannotBeIsRefused) {
  using core::ErrorKind;
  test::expect_error(ErrorKind::Config, {"hatchbak", "hatchback"},
                     [] { options_of("things = [\"hatchbak\"]\n"); });
  test::expect_error(ErrorKind::Config, {"container_ship", "car, van"},
                     [] { options_of("things = [\"container_ship\"]\n"); });
  test::expect_error(ErrorKind::Config, {"person", "vehicles", "car, van"},
                     [] { options_of("things = [\"person\"]\n"); });
  test::expect_error(ErrorKind::Config, {"hatchback", "people", "class person"},
                     [] { options_of("kind = \"people\"\nthings = [\"hatchback\"]\n"); });
  for (const tiler::ThingInfo& thing : tiler::all_things()) {
    // By the names of their classes, as docs/classes.md has them.
    const std::string_view what =
        core::semantic_class_names()[static_cast<std::size_t>(thing.semantic_class)];
    const std::string toml = fmt::format("things = [\"{}\"]\n", thing.name);
    const auto is_taken = [](const std::string& text) {
      try {
        options_of(text);
      } catch (const core::Error&) {
        return false;
      }
      return true;
    };
    if (what != "truck") {
      EXPECT_EQ(is_taken(toml), what == "car" || what == "van" || what == "bus") << thing.name;
    }
    EXPECT_EQ(is_taken("kind = \"people\"\n" + toml), what == "person") << thing.name;
  }
  test::expect_error(ErrorKind::Config, {"amount", "0.01 to 20"},
                     [] { options_of("amount = -1.0\n"); });
  test::expect_error(ErrorKind::Config, {"amount"}, [] { options_of("amount = nan\n"); });
  test::expect_error(ErrorKind::Config, {"kind", "people"},
                     [] { options_of("kind = \"trams\"\n"); });
  const std::vector<TrafficOptions> twice = {options_of("seed = 4\n"), options_of("seed = 4\n")};
  test::expect_error(ErrorKind::Config, {"vehicles", "seed = 4"}, [&] { check_traffic(twice); });
  const std::vector<TrafficOptions> apart = {options_of("seed = 4\n"), options_of("seed = 5\n"),
                                             options_of("kind = \"people\"\nseed = 4\n")};
  EXPECT_NO_THROW(check_traffic(apart));
  test::expect_error(ErrorKind::Config, {"name", "letters"},
                     [] { options_of("name = \"a b\"\n"); });
}

TEST(PathCurve, OfACircleIsItsLengthAndCurvature) {
  // Points of a circle of 40 m, 2 m apart: the spline lies inside by a sixth of the sagitta of neighbours.
  constexpr double kRadius_m = 40.0;
  std::vector<PathPoint> points;
  for (int i = 0; i < 60; ++i) {
    const double angle = 2.0 * i / kRadius_m;
    points.push_back(
        {.at_world = kRadius_m * Vector2d(std::cos(angle), std::sin(angle)), .limit_mps = 10.0});
  }
  const PathCurve curve(points);
  const double inside_m = kRadius_m * (1.0 - std::cos(2.0 / kRadius_m)) / 3.0;
  const double radius_m = kRadius_m - inside_m;
  EXPECT_NEAR(curve.length_m(), 57 * 2.0 * radius_m / kRadius_m, 1e-3);
  for (double at_m = 0.0; at_m < curve.length_m(); at_m += 1.7) {
    const PathCurve::Place place = curve.at(at_m);
    EXPECT_NEAR(place.at_world.norm(), radius_m, 1e-4);
    EXPECT_NEAR(place.curvature_per_m, 1.0 / radius_m, 1e-3);
    const double angle = std::atan2(place.at_world.y(), place.at_world.x());
    EXPECT_NEAR(angle < 0 ? angle + 2 * std::numbers::pi : angle, 2.0 / kRadius_m + at_m / radius_m,
                1e-4);
  }
  const Drive drive(curve, {.lateral_mps2 = 1.0, .accelerate_mps2 = 1.0, .brake_mps2 = 1.0});
  EXPECT_NEAR(drive.at(1.0).speed_mps, std::sqrt(radius_m), 0.05);
  EXPECT_NEAR(drive.time_s(drive.at(3.3).at_m), 3.3, 1e-9);
}

/// Along a curve from its start, by a great many chords that Place's own lengths do not come into.
double sum_of_chords_m(const std::vector<PathPoint>& points, double to_segment) {
  const auto at = [&](double segment) {
    const auto k = std::min(static_cast<std::size_t>(segment), points.size() - 4);
    const double u = segment - static_cast<double>(k);
    // The basis in its textbook's form.
    const double w[4] = {std::pow(1 - u, 3) / 6, (3 * u * u * u - 6 * u * u + 4) / 6,
                         (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6, u * u * u / 6};
    Vector2d sum = Vector2d::Zero();
    for (std::size_t i = 0; i < 4; ++i) sum += w[i] * points[k + i].at_world;
    return sum;
  };
  const int num = static_cast<int>(to_segment * 2000) + 1;
  double length_m = 0.0;
  for (int i = 0; i < num; ++i)
    length_m += (at(to_segment * (i + 1) / num) - at(to_segment * i / num)).norm();
  return length_m;
}

TEST(PathCurve, IsAsFarAlongAsIsAskedOnTurnsAndInHairpins) {
  const auto worst_m = [](const std::vector<Vector2d>& corners) {
    std::vector<PathPoint> points;
    for (const Vector2d& corner : corners) points.push_back({.at_world = corner, .limit_mps = 9.0});
    const PathCurve curve(points);
    double worst = 0.0;
    const auto num = static_cast<double>(points.size() - 3);
    for (double segment = 0.05; segment < num; segment += 0.37) {
      const auto k = static_cast<std::size_t>(segment);
      const double u = segment - static_cast<double>(k);
      const double w[4] = {std::pow(1 - u, 3) / 6, (3 * u * u * u - 6 * u * u + 4) / 6,
                           (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6, u * u * u / 6};
      Vector2d truth = Vector2d::Zero();
      for (std::size_t i = 0; i < 4; ++i) truth += w[i] * corners[k + i];
      const Vector2d found = curve.at(sum_of_chords_m(points, segment)).at_world;
      worst = std::max(worst, (found - truth).norm());
    }
    return worst;
  };
  std::vector<Vector2d> turn, hairpin;
  for (int i = 0; i < 12; ++i) {
    const double angle = i * 2.0 / 4.0;
    turn.push_back(4.0 * Vector2d(std::cos(angle), std::sin(angle)));
  }
  for (int i = 0; i < 6; ++i) hairpin.emplace_back(2.0 * i, 0.0);
  for (int i = 5; i >= 0; --i) hairpin.emplace_back(2.0 * i, 2.0);
  const double of_turn_m = worst_m(turn), of_hairpin_m = worst_m(hairpin);
  RecordProperty("turn_m", fmt::format("{}", of_turn_m));
  RecordProperty("hairpin_m", fmt::format("{}", of_hairpin_m));
  EXPECT_LT(of_turn_m, 1e-6);
  EXPECT_LT(of_hairpin_m, 1e-5);
}

}  // namespace
}  // namespace terracast::job
