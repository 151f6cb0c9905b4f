#include "job/traffic/trains.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/semantic_class.h"
#include "job/traffic/rail_car.h"
#include "job/traffic/train_rows.h"
#include "tests/support/expect_error.h"
#include "tests/support/traffic_town.h"

namespace terracast::job {
namespace {

using namespace test;

constexpr double kHalfBed_m = 2.2;

/// A line of points on an arc, from a heading on; heading and place go on to its end.
void append_arc(std::vector<Vector2d>& points, double& heading_rad, double length_m,
                double curvature_per_m) {
  const int num = std::max(1, static_cast<int>(length_m / 2.0));
  const double step_m = length_m / num;
  for (int i = 0; i < num; ++i) {
    const double middle_rad = heading_rad + 0.5 * step_m * curvature_per_m;
    points.push_back(points.back() + step_m * Vector2d(std::cos(middle_rad), std::sin(middle_rad)));
    heading_rad += step_m * curvature_per_m;
  }
}

/// A single line of 8 km through bends of 300 m and 500 m, in parts that meet end to end.
std::vector<std::vector<Vector2d>> winding_line() {
  std::vector<std::vector<Vector2d>> parts;
  double heading_rad = 0.0;
  Vector2d at(-3500.0, -200.0);
  for (const auto& [length_m, curvature] : {std::pair{2500.0, 0.0},
                                            {300.0, 1.0 / 300.0},
                                            {200.0, 0.0},
                                            {300.0, -1.0 / 300.0},
                                            {600.0, 0.0},
                                            {400.0, -1.0 / 500.0},
                                            {400.0, 1.0 / 500.0},
                                            {3000.0, 0.0}}) {
    std::vector<Vector2d> points = {at};
    append_arc(points, heading_rad, length_m, curvature);
    at = points.back();
    parts.push_back(std::move(points));
  }
  return parts;
}

/// Of a place, the nearest railway, by all its segments.
Nearest nearest_track(const world::WayNetwork& network, const Vector2d& at) {
  world::WayNetwork tracks;
  for (const WayPart& part : network.parts)
    if (world::is_railway(part.kind)) tracks.parts.push_back(part);
  for (WayPart& part : tracks.parts) part.kind = WayKind::Path;
  Nearest found = nearest(tracks, at, false);
  for (const WayPart& part : network.parts)
    if (found.part != nullptr && part.feature == found.part->feature) {
      found.part = &part;
      break;
    }
  return found;
}

double pivots_of(const MovingThing& car) { return tiler::find_thing(car.shape.thing)->pivots_m; }
std::array<Vector2d, 2> pivot_places(const MovingThing& car, const geo::BodyState& state) {
  const Vector2d half = 0.5 * pivots_of(car) * forward_of(state);
  return {place_of(state) + half, place_of(state) - half};
}

/// The name of a car's train.
std::string train_of(const MovingThing& car) { return car.name.substr(0, car.name.rfind('-')); }

/// Cars by trains, each from its head.
std::map<std::string, std::vector<const MovingThing*>> by_train(
    const std::vector<MovingThing>& things) {
  std::map<std::string, std::vector<const MovingThing*>> trains;
  for (const MovingThing& thing : things)
    if (thing.name.starts_with("train-")) trains[train_of(thing)].push_back(&thing);
  return trains;
}

PathCurve circle(double radius_m, int num_points) {
  std::vector<PathPoint> points;
  for (int i = 0; i < num_points; ++i) {
    const double angle = 2.0 * i / radius_m;
    points.push_back(
        {.at_world = radius_m * Vector2d(std::cos(angle), std::sin(angle)), .limit_mps = 20.0});
  }
  return PathCurve(points);
}

TEST(RailCar, OnACircleIsAChordInClosedForm) {
  constexpr double kRadius_m = 150.0, kSpeed_mps = 12.0, kAlong_mps2 = 0.3, kPivots_m = 19.0;
  const PathCurve curve = circle(kRadius_m, 100);
  // The spline lies inside by a sixth of the sagitta of neighbours.
  const double radius_m = kRadius_m - kRadius_m * (1.0 - std::cos(2.0 / kRadius_m)) / 3.0;
  const double middle_m = std::sqrt(radius_m * radius_m - 0.25 * kPivots_m * kPivots_m);
  for (double front_m = 25.0; front_m < 190.0; front_m += 7.3) {
    const CarMotion car = car_motion(
        curve, front_m, {.speed_mps = kSpeed_mps, .acceleration_mps2 = kAlong_mps2}, kPivots_m);
    EXPECT_NEAR(car.at_world.norm(), middle_m, 1e-4);
    const Vector2d outward = car.at_world.normalized(), along(-outward.y(), outward.x());
    EXPECT_NEAR(car.forward.dot(along), 1.0, 1e-9);
    const double turning = kSpeed_mps / radius_m;
    EXPECT_NEAR(car.turning_radps, turning, 2e-5);
    EXPECT_LT((car.velocity_mps - turning * middle_m * along).norm(), 2e-3);
    const Vector2d acceleration =
        kAlong_mps2 * middle_m / radius_m * along - turning * turning * middle_m * outward;
    EXPECT_LT((car.acceleration_mps2 - acceleration).norm(), 2e-3);
    EXPECT_NEAR(front_m - car.rear_m, 2.0 * radius_m * std::asin(0.5 * kPivots_m / radius_m), 1e-5);
  }
}

TEST(RailCar, MovesAsItsPlacesDoAndKeepsBothPivotsOnTheCurve) {
  // A bend into the other one: curvature changes all along it.
  std::vector<PathPoint> points;
  for (int i = 0; i < 120; ++i)
    points.push_back({.at_world = {2.0 * i, 25.0 * std::sin(i / 14.0)}, .limit_mps = 20.0});
  const PathCurve curve(points);
  constexpr double kStep_s = 1e-3, kPivots_m = 14.2;
  const auto at = [&](double time_s) {
    const Drive::Progress progress{.at_m = 60.0 + 9.0 * time_s + 0.35 * time_s * time_s,
                                   .speed_mps = 9.0 + 0.7 * time_s,
                                   .acceleration_mps2 = 0.7};
    return car_motion(curve, progress.at_m, progress, kPivots_m);
  };
  for (double time_s = 0.0; time_s < 8.0; time_s += 0.23) {
    const CarMotion car = at(time_s), before = at(time_s - kStep_s), after = at(time_s + kStep_s);
    const double front_m = 60.0 + 9.0 * time_s + 0.35 * time_s * time_s;
    EXPECT_LT((car.at_world + 0.5 * kPivots_m * car.forward - curve.at(front_m).at_world).norm(),
              1e-9);
    EXPECT_LT((car.at_world - 0.5 * kPivots_m * car.forward - curve.at(car.rear_m).at_world).norm(),
              1e-9);
    EXPECT_LT(((after.at_world - before.at_world) / (2.0 * kStep_s) - car.velocity_mps).norm(),
              1e-4);
    // At joints of the curve its third derivative jumps.
    EXPECT_LT(((after.velocity_mps - before.velocity_mps) / (2.0 * kStep_s) - car.acceleration_mps2)
                  .norm(),
              0.02);
    const double turned =
        before.forward.x() * after.forward.y() - before.forward.y() * after.forward.x();
    EXPECT_NEAR(std::asin(turned) / (2.0 * kStep_s), car.turning_radps, 1e-4);
  }
}

TEST(Trains, KeepBothBogiesOfEachCarOnTheirTrackThroughBends) {
  Town town;
  for (const auto& points : winding_line()) town.add(WayKind::Rail, points, kHalfBed_m, 1);
  int num_cars = 0, num_in_bends = 0;
  std::set<std::string> kinds;
  for (int seed = 1; seed <= 6; ++seed) {
    const auto things = traffic_of(
        town.network,
        fmt::format("kind = \"trains\"\namount = 20.0\nreach_m = 3000.0\nseed = {}\n", seed),
        frames_at(2.0, 21));
    for (const auto& [name, cars] : by_train(things)) {
      for (std::size_t c = 0; c < cars.size(); ++c) {
        const MovingThing& car = *cars[c];
        ++num_cars;
        kinds.insert(car.shape.thing);
        EXPECT_EQ(car.ride, scene::Ride::Rails);
        EXPECT_EQ(car.semantic_id, static_cast<std::uint32_t>(core::SemanticClass::Train));
        EXPECT_NEAR(car.footing_m.x(), pivots_of(car), 1e-12);
        for (std::size_t i = 0; i < car.states.size(); ++i) {
          ASSERT_TRUE(car.states[i]);
          const geo::BodyState& state = *car.states[i];
          for (const Vector2d& pivot : pivot_places(car, state)) {
            const Nearest track = nearest_track(town.network, pivot);
            // The spline through points 2 m apart cuts bends of 300 m by 2 mm, the line's own chords by as much.
            EXPECT_LT(track.distance_m, 0.01) << name << ' ' << c;
            EXPECT_GT(std::abs(track.direction.dot(forward_of(state))), 0.99);
          }
          // In a bend of 300 m the middle of a car between pivots 17 m apart is 0.12 m inside.
          if (nearest_track(town.network, place_of(state)).distance_m > 0.05) ++num_in_bends;
          // Cars hang together: their ends meet, but for what chords are shorter than bends.
          if (c == 0) continue;
          const MovingThing& before = *cars[c - 1];
          const Vector2d rear = place_of(*before.states[i]) -
                                0.5 * size_of(before).x() * forward_of(*before.states[i]);
          const Vector2d front = place_of(state) + 0.5 * size_of(car).x() * forward_of(state);
          EXPECT_LT((rear - front).norm(), 0.30);
          EXPECT_LT(std::abs((rear - front).dot(forward_of(state))), 0.06);
        }
      }
    }
  }
  EXPECT_GT(num_cars, 25);
  EXPECT_GT(num_in_bends, 40);
  EXPECT_TRUE(kinds.contains("railcar") && kinds.contains("locomotive"));
}

TEST(Trains, GoNoFasterThanAllTheirCarsMay) {
  Town town;
  for (const auto& points : winding_line()) town.add(WayKind::Rail, points, kHalfBed_m, 1);
  town.network.parts[0].max_speed_kmph = 160;
  town.network.parts[4].max_speed_kmph = 60;
  constexpr double kRate_hz = 100.0;
  const auto frames = frames_at(kRate_hz, 1501);
  double fastest = 0.0;
  for (int seed = 1; seed <= 4; ++seed) {
    const auto things = traffic_of(
        town.network,
        fmt::format("kind = \"trains\"\namount = 20.0\nreach_m = 2500.0\nseed = {}\n", seed),
        frames);
    for (const MovingThing& car : things)
      for (std::size_t i = 1; i + 1 < frames.size(); i += 50) {
        const geo::BodyState& before = *car.states[i - 1];
        const geo::BodyState& here = *car.states[i];
        const geo::BodyState& after = *car.states[i + 1];
        const Vector2d velocity = (place_of(after) - place_of(before)) * (0.5 * kRate_hz);
        EXPECT_LT((velocity - here.velocity_world_mps.head<2>()).norm(), 0.01);
        const Vector2d acceleration =
            (after.velocity_world_mps - before.velocity_world_mps).head<2>() * (0.5 * kRate_hz);
        EXPECT_LT((acceleration - here.acceleration_world_mps2.head<2>()).norm(), 0.3);
        EXPECT_NEAR((car.gone_m[i + 1] - car.gone_m[i - 1]) * 0.5 * kRate_hz, velocity.norm(),
                    0.05);
        // Across 1.3 m/s^2, along 0.4 and 0.5.
        EXPECT_LT(velocity.norm() * std::abs(here.angular_velocity_body_radps.z()), 1.3 + 0.05);
        EXPECT_LT(std::abs(acceleration.dot(forward_of(here))), 0.5 + 0.05);
        const WayPart& part = *nearest_track(town.network, place_of(here)).part;
        const double limit_kmph = part.max_speed_kmph > 0 ? part.max_speed_kmph : 100.0;
        EXPECT_LE(velocity.norm(), limit_kmph / 3.6 + 0.01) << part.feature;
        fastest = std::max(fastest, velocity.norm());
      }
  }
  EXPECT_GT(fastest, 80.0 / 3.6) << "bends of 300 m allow 71 km/h";
}

TEST(Trains, KeepToTheirSideOfTwoTracksAndApartOnEach) {
  Town town;
  // The second line is drawn against the first; each of three parts.
  for (const double x : {-30000.0, -10000.0, 10000.0}) {
    town.add(WayKind::Rail, {{x, 0}, {x + 20000.0, 0}}, kHalfBed_m, 1);
    town.add(WayKind::Rail, {{x + 20000.0, 4.2}, {x, 4.2}}, kHalfBed_m, 1);
  }
  const WayGraph ways(town.network);
  const core::Log log("test", core::LogLevel::Off);
  for (const bool on_left : {false, true}) {
    const std::vector<TrafficOptions> options = {
        options_of(std::string("kind = \"trains\"\namount = 3.0\nmost = 5000\nreach_m = 5000.0\n") +
                   (on_left ? "drives_on_left = true\n" : ""))};
    std::map<bool, std::vector<double>> ends, heads;
    std::vector<geo::BodyState> frames = frames_at(1.0, 2, {0, 0});
    for (double x = -24000.0; x <= 24000.0; x += 4000.0) {
      frames.push_back(frames.front());
      frames.back().world_from_body.translation.x() = x;
    }
    const auto things = lay_out_traffic(
        options, frames, 1.0,
        {.ways = ways, .half_size_m = 40000.0, .obstacles = {}, .standing = {}}, log);
    for (const auto& [name, cars] : by_train(things)) {
      const geo::BodyState& head = *cars.front()->states[0];
      const geo::BodyState& end = *cars.back()->states[0];
      const bool is_east = forward_of(head).x() > 0.0;
      // Who goes east has the other track, 4.2 m to the north, at the left.
      EXPECT_NEAR(place_of(head).y(), is_east != on_left ? 0.0 : 4.2, 1e-3) << name;
      const double sign = is_east ? 1.0 : -1.0;
      heads[is_east].push_back(sign * place_of(head).x() + 0.5 * size_of(*cars.front()).x());
      ends[is_east].push_back(sign * place_of(end).x() - 0.5 * size_of(*cars.back()).x());
    }
    ASSERT_EQ(heads.size(), 2U);
    for (const bool is_east : {true, false}) {
      std::sort(heads[is_east].begin(), heads[is_east].end());
      std::sort(ends[is_east].begin(), ends[is_east].end());
      ASSERT_GT(heads[is_east].size(), 3U);
      for (std::size_t k = 1; k < heads[is_east].size(); ++k)
        EXPECT_GT(ends[is_east][k] - heads[is_east][k - 1], 120.0 * 100.0 / 3.6 - 1.0);
    }
  }
}

TEST(Trains, AreAsManyAsIsAskedOnAnyLengthOfLine) {
  Town town;
  town.add(WayKind::Tram, {{-200000, 0}, {200000, 0}}, kHalfBed_m, 2);
  const WayGraph ways(town.network);
  std::vector<geo::BodyState> frames(1);
  for (const double amount : {0.5, 1.0}) {
    const std::vector<TrafficOptions> options = {
        options_of(fmt::format("kind = \"trains\"\namount = {}\nreach_m = 5000.0\n", amount))};
    // Proposals on both tracks of the whole part, which is near.
    const auto proposals = propose_trains(options, frames, 1.0, ways);
    const double expected = 2.0 * 400.0 * 0.4 * amount;
    EXPECT_NEAR(static_cast<double>(proposals.size()), expected, 4.0 * std::sqrt(expected));
    int num_forward = 0;
    for (const TrainProposal& one : proposals) num_forward += one.start.arm.is_forward ? 1 : 0;
    EXPECT_NEAR(num_forward, 0.5 * expected, 4.0 * std::sqrt(expected));
  }
}

TEST(Trains, NeverFaceEachOtherOnASingleTrack) {
  Town town;
  for (double x = -20000.0; x < 20000.0; x += 1000.0)
    town.add(WayKind::LightRail, {{x, 0}, {x + 1000.0, 0}}, kHalfBed_m, 1);
  const WayGraph ways(town.network);
  const core::Log log("test", core::LogLevel::Off);
  int num = 0, num_west = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    const std::vector<TrafficOptions> options = {options_of(
        fmt::format("kind = \"trains\"\namount = 4.0\nreach_m = 5000.0\nseed = {}\n", seed))};
    const auto things = lay_out_traffic(
        options, frames_at(1.0, 2, {0, 0}), 1.0,
        {.ways = ways, .half_size_m = 40000.0, .obstacles = {}, .standing = {}}, log);
    std::vector<std::pair<double, bool>> heads;  // x, whether it goes east
    for (const auto& [name, cars] : by_train(things))
      heads.emplace_back(place_of(*cars.front()->states[0]).x(),
                         forward_of(*cars.front()->states[0]).x() > 0.0);
    std::sort(heads.begin(), heads.end());
    for (std::size_t k = 0; k < heads.size(); ++k) {
      ++num;
      num_west += heads[k].second ? 0 : 1;
      if (k == 0 || !heads[k - 1].second || heads[k].second) continue;
      EXPECT_GT(heads[k].first - heads[k - 1].first, 90.0 * 70.0 / 3.6 - 200.0);
    }
  }
  EXPECT_GT(num, 40);
  EXPECT_GT(num_west, num / 5);
}

/// A line that a road crosses at one level at a node of both, 12 times.
Town crossings() {
  Town town;
  for (int i = 0; i < 12; ++i) {
    const double x = -1100.0 + 200.0 * i;
    town.add(WayKind::Tram, {{x, 0}, {x + 200.0, 0}}, kHalfBed_m, 1);
    town.add(WayKind::Primary, {{x, -1500}, {x, 0}}, 4.0, 2);
    town.add(WayKind::Primary, {{x, 0}, {x, 1500}}, 4.0, 2);
  }
  town.add(WayKind::Tram, {{-2500, 0}, {-1100, 0}}, kHalfBed_m, 1);
  town.add(WayKind::Tram, {{1300, 0}, {2500, 0}}, kHalfBed_m, 1);
  return town;
}

/// Whether boxes of any length have a point of a fine grid in common.
bool overlap(const MovingThing& a, const MovingThing& b, std::size_t frame) {
  const geo::BodyState& of_a = *a.states[frame];
  const geo::BodyState& of_b = *b.states[frame];
  const double reach_m = 0.5 * (size_of(a).norm() + size_of(b).norm());
  if ((place_of(of_a) - place_of(of_b)).norm() > reach_m) return false;
  const geo::Rigid3d b_from_a = of_b.world_from_body.inverse() * of_a.world_from_body;
  for (int i = -20; i <= 20; ++i)
    for (int j = -4; j <= 4; ++j) {
      const Vector3d at =
          b_from_a * Vector3d(0.025 * i * size_of(a).x(), 0.125 * j * size_of(a).y(), 0.0);
      if (std::abs(at.x()) < 0.5 * size_of(b).x() && std::abs(at.y()) < 0.5 * size_of(b).y())
        return true;
    }
  return false;
}

TEST(Trains, GoFirstAtLevelCrossings) {
  const Town town = crossings();
  const WayGraph ways(town.network);
  const core::Log log("test", core::LogLevel::Off);
  const auto frames = frames_at(5.0, 61, {0, 0});
  const std::string of_trains = "kind = \"trains\"\namount = 10.0\nreach_m = 1500.0\nseed = ";
  int num_met = 0, num_trains = 0;
  for (const char* seed : {"1\n", "2\n", "3\n"}) {
    const auto laid_out = [&](const std::vector<TrafficOptions>& options) {
      return lay_out_traffic(options, frames, frames.back().time_s,
                             {.ways = ways, .half_size_m = 3000.0, .obstacles = {}, .standing = {}},
                             log);
    };
    const TrafficOptions trains = options_of(of_trains + seed);
    const TrafficOptions vehicles = options_of("amount = 8.0\nreach_m = 1500.0\nmost = 1000\n");
    const auto both = laid_out({vehicles, trains});
    const auto alone = laid_out({trains}), cars_alone = laid_out({vehicles});
    const auto of_both = by_train(both), of_alone = by_train(alone);
    ASSERT_EQ(of_both.size(), of_alone.size());
    num_trains += static_cast<int>(of_both.size());
    for (const auto& [name, cars] : of_both) EXPECT_TRUE(of_alone.contains(name));
    const auto count = [&](const std::vector<MovingThing>& vehicles_there) {
      int num = 0;
      for (const MovingThing& train : alone)
        for (const MovingThing& vehicle : vehicles_there)
          if (!vehicle.name.starts_with("train-"))
            for (std::size_t i = 0; i < frames.size(); ++i)
              num += overlap(vehicle, train, i) ? 1 : 0;
      return num;
    };
    num_met += count(cars_alone);
    EXPECT_EQ(count(both), 0);
    for (std::size_t i = 0; i < frames.size(); i += 10)
      for (std::size_t a = 0; a < alone.size(); ++a)
        for (std::size_t b = 0; b < a; ++b)
          EXPECT_FALSE(train_of(alone[a]) != train_of(alone[b]) && overlap(alone[a], alone[b], i));
  }
  EXPECT_GT(num_trains, 3);
  EXPECT_GT(num_met, 0);
}

TEST(Trains, StayOutOfTunnelsOffSidingsAndWhereTheirWayEndsThereAreNone) {
  Town town;
  town.add(WayKind::Subway, {{-5000, 0}, {0, 0}}, kHalfBed_m, 1);
  town.add(WayKind::Subway, {{0, 0}, {3000, 0}}, kHalfBed_m, 1).is_tunnel = true;
  town.add(WayKind::Subway, {{-5000, 50}, {3000, 50}}, kHalfBed_m, 1).is_siding = true;
  town.add(WayKind::Funicular, {{-5000, 90}, {3000, 90}}, kHalfBed_m, 1);
  int num = 0;
  for (int seed = 1; seed <= 20; ++seed) {
    const auto things = traffic_of(
        town.network,
        fmt::format("kind = \"trains\"\namount = 20.0\nreach_m = 5000.0\nseed = {}\n", seed),
        frames_at(1.0, 11));
    num += static_cast<int>(things.size());
    for (const MovingThing& car : things)
      for (const auto& state : car.states) {
        EXPECT_LT(place_of(*state).x(), 0.0) << "the tunnel begins there";
        EXPECT_NEAR(place_of(*state).y(), 0.0, 1e-3);
      }
  }
  EXPECT_GT(num, 20);
}

TEST(Trains, AreRowsOfCarsThatGoTogether) {
  for (const RailKind& rail : rail_kinds()) {
    const auto rows = rows_on(rail.kind, {});
    ASSERT_FALSE(rows.empty());
    double share = 0.0;
    for (const TrainRow& row : rows) share += row.share;
    EXPECT_NEAR(share, 1.0, 1e-12);
    std::map<std::string, int> leads;
    for (std::uint64_t key = 1; key <= 400; ++key) {
      const DrawnTrain train = draw_train(rows, key);
      EXPECT_LE(train.length_m(), longest_m(rows) + 1e-9);
      EXPECT_LE(train.length_m(), 400.0) << "so far is looked for who is in the way";
      ++leads[train.cars.front().thing->name];
      for (std::size_t i = 1; i < train.cars.size(); ++i)
        EXPECT_NE(train.cars[i].thing->name, "locomotive");
    }
    if (rail.kind == WayKind::Rail) {
      EXPECT_NEAR(leads["locomotive"], 200, 50);
    }
  }
  const std::vector<std::string> freight = {"locomotive", "container_wagon"};
  ASSERT_EQ(rows_on(WayKind::Rail, freight).size(), 1U);
  EXPECT_TRUE(rows_on(WayKind::Tram, freight).empty());
  using core::ErrorKind;
  test::expect_error(ErrorKind::Config, {"hatchback", "trains", "class train"},
                     [] { options_of("kind = \"trains\"\nthings = [\"hatchback\"]\n"); });
  test::expect_error(ErrorKind::Config, {"locomotive", "passenger_coach", "container_wagon"},
                     [] { options_of("kind = \"trains\"\nthings = [\"locomotive\"]\n"); });
  test::expect_error(ErrorKind::Config, {"tram", "car, van"},
                     [] { options_of("things = [\"tram\"]\n"); });
  EXPECT_NO_THROW(options_of("kind = \"trains\"\nthings = [\"tram\", \"railcar\"]\n"));
}

}  // namespace
}  // namespace terracast::job
