// Flights that are laid out over the ground: surveys and explorations.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "geo/paths/area.h"
#include "geo/paths/ground_track.h"
#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using test::GroundWorld;
using test::message_of;
using test::options_from;
using test::trajectory_from;

constexpr double kDegree = std::numbers::pi / 180.0;

/// Hills of 80 m, 1.5 km apart, and gentler ones across.
GroundWorld hilly_world() {
  GroundWorld world;
  world.ground = [frame = world.frame](double lat_deg, double lon_deg) -> std::optional<double> {
    const Eigen::Vector3d at = frame.world_from_geodetic({lat_deg, lon_deg, 1000.0});
    if (at.head<2>().cwiseAbs().maxCoeff() > 8000.0) return std::nullopt;
    return 1000.0 + 80.0 * std::sin(2.0 * std::numbers::pi * at.x() / 1500.0) +
           20.0 * std::sin(2.0 * std::numbers::pi * at.y() / 900.0);
  };
  return world;
}

const char* const kField = R"(
kind = "survey"
rate_hz = 0.5
area = [
  { east_m = 0.0, north_m = 0.0 },
  { east_m = 1200.0, north_m = 0.0 },
  { east_m = 1200.0, north_m = 800.0 },
  { east_m = 0.0, north_m = 600.0 },
]
heading_deg = 90.0
height_m = 150.0
view_across_deg = 60.0
view_along_deg = 45.0
overlap = 0.8
sidelap = 0.6
)";

std::unique_ptr<Trajectory> fly_field(const std::string& text, const GroundWorld& world) {
  TrajectoryContext context = world.context();
  context.rate_hz = 0.5;
  return options_from(text).kind_options().build(context);
}

TEST(Survey, ShowsEveryPlaceOfTheAreaAsOftenAsItsOverlapsSay) {
  const GroundWorld world = hilly_world();
  const SampledFrames frames = sample_frames(options_from(kField), world.context());
  const double spacing_m = 2.0 * 150.0 * std::tan(30.0 * kDegree) * 0.4;
  for (double x = 5.0; x < 1200.0; x += 35.0)
    for (double y = 5.0; y < 600.0 + x / 6.0 - 5.0; y += 35.0) {
      int count = 0;
      for (const BodyState& state : frames.states) {
        const Eigen::Vector3d& at = state.world_from_body.translation;
        // Pictures of straight and level flight, sides east and north.
        if (std::abs(state.velocity_world_mps.normalized().x()) < 0.9999) continue;
        const Geodetic place = world.frame.geodetic_from_world({x, y, at.z()});
        const double agl_m = world.frame.geodetic_from_world(at).height_m -
                             *world.ground(place.lat_deg, place.lon_deg);
        count += std::abs(at.x() - x) <= agl_m * std::tan(22.5 * kDegree) &&
                         std::abs(at.y() - y) <= agl_m * std::tan(30.0 * kDegree)
                     ? 1
                     : 0;
      }
      // Every fifth of a picture one more, from two lines but at the outer border.
      const bool is_inside = y > spacing_m && y < 600.0 + x / 6.0 - spacing_m;
      ASSERT_GE(count, is_inside ? 10 : 5) << x << ", " << y;
    }
}

TEST(Survey, FliesStraightLevelLinesWithCoordinatedTurnsBetween) {
  const GroundWorld world = hilly_world();
  const auto motion = fly_field(kField, world);
  const double speed_mps = 2.0 * 150.0 * std::tan(22.5 * kDegree) * 0.2 * 0.5;
  double straight_s = 0.0, most_roll = 0.0;
  constexpr int kCount = 4000;
  std::vector<double> northings;
  for (int i = 0; i <= kCount; ++i) {
    const BodyState state = motion->at(motion->duration_s() * i / kCount);
    const Geodetic place = world.frame.geodetic_from_world(state.world_from_body.translation);
    // Highest ground near (375, 225): 1100 m.
    ASSERT_NEAR(place.height_m, 1250.0, 0.5);
    ASSERT_NEAR(state.velocity_world_mps.norm(), speed_mps, 1e-6);
    const double roll = std::abs(test::roll_rad(world, state));
    most_roll = std::max(most_roll, roll);
    if (std::abs(state.velocity_world_mps.y()) > 1e-3 * speed_mps) continue;
    straight_s += motion->duration_s() / kCount;
    const Eigen::Vector3d& at = state.world_from_body.translation;
    if (at.x() > 100.0 && at.x() < 1100.0 && roll < 1e-3) northings.push_back(at.y());
  }
  EXPECT_GT(straight_s, 0.6 * motion->duration_s());
  EXPECT_LT(most_roll, 30.0 * kDegree);
  std::sort(northings.begin(), northings.end());
  const auto is_same_line = [](double a, double b) { return b - a < 1.0; };
  northings.erase(std::unique(northings.begin(), northings.end(), is_same_line), northings.end());
  // 800 m in lines that are at most 69.3 m apart: 12 of 66.7 m.
  ASSERT_EQ(northings.size(), 12u);
  for (std::size_t i = 0; i < northings.size(); ++i)
    EXPECT_NEAR(northings[i], (static_cast<double>(i) + 0.5) * 800.0 / 12.0, 0.1);
}

TEST(Survey, FollowsTheTerrainWithABoundedClimb) {
  GroundWorld world = hilly_world();
  const std::string text = std::string(kField) + "profile = \"terrain\"\nfollow_length_m = 60.0\n";
  const auto motion = fly_field(text, world);
  for (int i = 0; i <= 4000; ++i) {
    const Eigen::Vector3d at =
        motion->at(motion->duration_s() * i / 4000).world_from_body.translation;
    // Averaging hills of 1.5 km and 900 m over 60 m to both sides takes 0.7 m off. In turns, and at
    // the ends, the mean place is some 17 m beside the path, on slopes of up to 0.36.
    const bool is_on_a_line = at.x() > 100.0 && at.x() < 1100.0 && at.y() < 540.0;
    ASSERT_NEAR(test::agl_m(world, at), 150.0, is_on_a_line ? 1.0 : 6.0) << i;
  }
  // A wall of 200 m across the lines.
  world.ground = [frame = world.frame](double lat_deg, double lon_deg) -> std::optional<double> {
    return frame.world_from_geodetic({lat_deg, lon_deg, 1000.0}).x() < 600.0 ? 1000.0 : 1200.0;
  };
  const auto climbing = fly_field(text + "max_climb_deg = 12.0\nmin_agl_m = 50.0\n", world);
  double least_m = 1e9, most_climb = 0.0;
  for (int i = 0; i <= 20000; ++i) {
    const BodyState state = climbing->at(climbing->duration_s() * i / 20000);
    least_m = std::min(least_m, test::agl_m(world, state.world_from_body.translation));
    most_climb =
        std::max(most_climb, std::asin(std::abs(state.velocity_world_mps.normalized().dot(
                                 world.frame.up_world(state.world_from_body.translation)))));
  }
  EXPECT_GT(least_m, 49.9);
  EXPECT_LT(most_climb, 12.0 * kDegree);
  EXPECT_GT(most_climb, 10.0 * kDegree);
}

TEST(Survey, ADoubleGridFliesLinesAcrossTheFirst) {
  const GroundWorld world = hilly_world();
  const auto single = fly_field(kField, world);
  const auto twice = fly_field(std::string(kField) + "double_grid = true\n", world);
  EXPECT_GT(twice->duration_s(), 1.7 * single->duration_s());
  // East is flown first, north after; every strip of the field in both directions.
  const double spacing_m = 2.0 * 150.0 * std::tan(30.0 * kDegree) * 0.4;
  std::vector<double> north_lines, east_lines;
  double last_east_s = 0.0, first_north_s = 1e9;
  for (double time_s = 0.0; time_s < twice->duration_s(); time_s += 0.5) {
    const MotionState state = twice->at(time_s);
    const Eigen::Vector3d& at = state.world_from_body.translation;
    const Eigen::Vector3d way = state.velocity_world_mps.normalized();
    const bool is_over = at.x() > 100.0 && at.x() < 1100.0 && at.y() > 100.0 && at.y() < 500.0;
    if (!is_over) continue;
    if (std::abs(way.x()) > 0.99999) {
      east_lines.push_back(at.y());
      last_east_s = time_s;
    }
    if (std::abs(way.y()) > 0.99999) {
      north_lines.push_back(at.x());
      first_north_s = std::min(first_north_s, time_s);
    }
  }
  EXPECT_LT(last_east_s, first_north_s);
  const auto is_near = [&](const std::vector<double>& lines, double place) {
    return std::any_of(lines.begin(), lines.end(),
                       [&](double line) { return std::abs(line - place) < 0.51 * spacing_m; });
  };
  for (double place = 150.0; place < 450.0; place += 10.0) EXPECT_TRUE(is_near(east_lines, place));
  for (double place = 150.0; place < 1050.0; place += 10.0)
    EXPECT_TRUE(is_near(north_lines, place)) << place;
}

TEST(Survey, RefusesWhatCannotBeFlown) {
  const GroundWorld world = hilly_world();
  const auto refused = [&](core::ErrorKind kind, const std::string& corners,
                           const std::string& more) {
    return message_of(kind, [&] {
      trajectory_from("kind = \"survey\"\narea = [" + corners + "]\n" + more, world);
    });
  };
  const std::string square =
      "{ east_m = 0.0, north_m = 0.0 }, { east_m = 300.0, north_m = 0.0 }, { east_m = 300.0, "
      "north_m = "
      "300.0 }, { east_m = 0.0, north_m = 300.0 }";
  EXPECT_NE(
      refused(core::ErrorKind::Config, "{ east_m = 0.0, north_m = 0.0 }", "").find("1 corners"),
      std::string::npos);
  EXPECT_NE(
      refused(core::ErrorKind::Config,
              "{ east_m = 0.0, north_m = 0.0 }, { east_m = 300.0, north_m = 300.0 }, { east_m = "
              "300.0, north_m = 0.0 }, { east_m = 0.0, north_m = 300.0 }",
              "")
          .find("cross"),
      std::string::npos);
  EXPECT_NE(
      refused(core::ErrorKind::Config,
              "{ east_m = 0.0, north_m = 0.0 }, { east_m = 100.0, north_m = 100.0 }, { east_m = "
              "200.0, north_m = 200.0 }",
              "")
          .find("in a line"),
      std::string::npos);
  EXPECT_NE(refused(core::ErrorKind::Config, square, "view_along_deg = 170.0\nheight_m = 5000.0\n")
                .find("change rate_hz"),
            std::string::npos);
  EXPECT_NE(refused(core::ErrorKind::Config, square, "min_agl_m = 500.0\n").find("height_m"),
            std::string::npos);
  EXPECT_NE(
      refused(core::ErrorKind::Input,
              "{ east_m = 7000.0, north_m = 0.0 }, { east_m = 7900.0, north_m = 0.0 }, { east_m = "
              "7900.0, north_m = 800.0 }",
              "heading_deg = 90.0\noverlap = 0.95\n")
          .find("leaves the world's ground at lat"),
      std::string::npos);
}

TEST(GroundTrack, TurnsBackOntoTheNextLine) {
  for (const double left_m : {-500.0, -200.0, -30.0, 5.0, 199.0, 350.0}) {
    GroundTrack track({10.0, 20.0}, {0.0, 1.0});
    track.go_straight(100.0);
    track.turn_back(left_m, 100.0);
    const double begin_m = track.length_m();
    track.go_straight(40.0);
    EXPECT_LT((track.at(begin_m) - Eigen::Vector2d(10.0 - left_m, 120.0)).norm(), 1e-9) << left_m;
    EXPECT_LT((track.at(begin_m + 40.0) - Eigen::Vector2d(10.0 - left_m, 80.0)).norm(), 1e-9)
        << left_m;
    // By length, without a jump, and never sharper than its radius.
    constexpr double kStep_m = 0.5;
    for (double s = kStep_m; s + kStep_m < track.length_m(); s += kStep_m) {
      const Eigen::Vector2d a = track.at(s - kStep_m), b = track.at(s), c = track.at(s + kStep_m);
      ASSERT_NEAR((b - a).norm(), kStep_m, 1e-5);
      ASSERT_LT((a - 2.0 * b + c).norm() / (kStep_m * kStep_m), 1.0 / 100.0 + 1e-6);
    }
  }
}

TEST(GroundTrack, GoesToAPlaceAndDirectionBySmoothTurnsAndNoLongWay) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-300.0, 300.0), angle(-3.14, 3.14);
  constexpr double kRadius_m = 40.0;
  for (int tries = 0; tries < 500; ++tries) {
    const auto direction = [&] {
      const double a = angle(random);
      return Eigen::Vector2d(std::cos(a), std::sin(a));
    };
    const Eigen::Vector2d start(any(random), any(random)), place(any(random), any(random));
    const Eigen::Vector2d ahead = direction(), onward = direction();
    GroundTrack track(start, ahead);
    track.go_to(place, onward, kRadius_m);
    const double length_m = track.length_m();
    track.go_straight(10.0);
    ASSERT_LT((track.at(length_m) - place).norm(), 1e-9);
    ASSERT_LT((track.at(length_m + 10.0) - place - 10.0 * onward).norm(), 1e-9);
    // No longer than a full turn at both ends and the way between.
    ASSERT_LE(length_m, (place - start).norm() + 4.0 * std::numbers::pi * kRadius_m);
    constexpr double kStep_m = 0.5;
    for (double at = kStep_m; at + kStep_m < length_m; at += kStep_m) {
      const Eigen::Vector2d bend =
          track.at(at - kStep_m) - 2.0 * track.at(at) + track.at(at + kStep_m);
      ASSERT_LT(bend.norm() / (kStep_m * kStep_m), 1.001 / kRadius_m);
    }
  }
  // Straight ahead is straight.
  GroundTrack track({0.0, 0.0}, {1.0, 0.0});
  track.go_to({70.0, 0.0}, {1.0, 0.0}, kRadius_m);
  EXPECT_NEAR(track.length_m(), 70.0, 1e-9);
}

TEST(AreaTest, KnowsInsideAndItsStrips) {
  // An L.
  const Area area({{0, 0}, {10, 0}, {10, 4}, {4, 4}, {4, 10}, {0, 10}});
  EXPECT_TRUE(area.contains({2, 8}));
  EXPECT_TRUE(area.contains({8, 2}));
  EXPECT_FALSE(area.contains({8, 8}));
  EXPECT_FALSE(area.contains({-1, 2}));
  EXPECT_EQ(area.extent(Eigen::Vector2d(1, 0)), std::pair(0.0, 10.0));
  const Eigen::Vector2d east(1, 0), north(0, 1);
  EXPECT_EQ(*area.extent_of_strip(east, north, 5.0, 6.0), std::pair(0.0, 4.0));
  EXPECT_EQ(*area.extent_of_strip(east, north, 3.0, 6.0), std::pair(0.0, 10.0));
  EXPECT_FALSE(area.extent_of_strip(east, north, 11.0, 12.0));
  const Area slanted({{0, 0}, {10, 10}, {0, 10}});
  EXPECT_EQ(*slanted.extent_of_strip(east, north, 2.0, 6.0), std::pair(0.0, 6.0));
}

/// Walls, pits and steps that no straight line ignores.
GroundWorld rugged_world() {
  GroundWorld world;
  world.ground = [frame = world.frame](double lat_deg, double lon_deg) -> std::optional<double> {
    const Eigen::Vector3d at = frame.world_from_geodetic({lat_deg, lon_deg, 1000.0});
    if (at.head<2>().cwiseAbs().maxCoeff() > 3000.0) return std::nullopt;
    return 1000.0 + 150.0 * std::pow(std::sin(at.x() / 400.0) * std::cos(at.y() / 300.0), 2.0) +
           (std::fmod(std::abs(at.x() + 0.5 * at.y()), 200.0) < 60.0 ? 12.0 : 0.0);
  };
  return world;
}

std::string exploration(int seed, const std::string& more = "") {
  return fmt::format(R"(
kind = "explore"
area = [
  {{ east_m = -2500.0, north_m = -2500.0 }},
  {{ east_m = 2500.0, north_m = -2500.0 }},
  {{ east_m = 2500.0, north_m = 2500.0 }},
]
seed = {}
num_legs = 12
speed_mps = 14.0
min_agl_m = 30.0
lowest_agl_m = 45.0
highest_agl_m = 120.0
{})",
                     seed, more);
}

TEST(Explore, StaysInItsAreaAndClearOfRuggedGround) {
  const GroundWorld world = rugged_world();
  const Area area({{-2500.0, -2500.0}, {2500.0, -2500.0}, {2500.0, 2500.0}});
  for (const int seed : {1, 2, 3, 4}) {
    const auto motion = trajectory_from(exploration(seed), world);
    EXPECT_GT(motion->duration_s() * 14.0, 12 * 200.0);
    double least_m = 1e9, most_roll = 0.0;
    const int count = static_cast<int>(motion->duration_s() * 14.0 / 0.5);  // every half metre
    for (int i = 0; i <= count; ++i) {
      const BodyState state = motion->at(motion->duration_s() * i / count);
      least_m = std::min(least_m, test::agl_m(world, state.world_from_body.translation));
      most_roll = std::max(most_roll, std::abs(test::roll_rad(world, state)));
      ASSERT_TRUE(area.contains(state.world_from_body.translation.head<2>())) << seed;
    }
    // Places 5 m apart are looked at; a step of 12 m between them may rise a part of the slope early.
    EXPECT_GT(least_m, 30.0 - 1.0) << seed;
    // It turns as tightly as it banks, not more.
    EXPECT_LT(most_roll, 30.0 * kDegree) << seed;
    EXPECT_GT(most_roll, 3.0 * kDegree) << seed;
  }
}

TEST(Explore, AnotherSeedIsAnotherFlight) {
  const GroundWorld world = rugged_world();
  const auto start = [&](int seed) {
    return trajectory_from(exploration(seed), world)->at(0.0).world_from_body.translation;
  };
  EXPECT_EQ(start(5), start(5));
  EXPECT_GT((start(5) - start(6)).norm(), 10.0);
}

TEST(Explore, ATooNarrowAreaIsRefused) {
  GroundWorld world;
  const std::string message = message_of(core::ErrorKind::Input, [&] {
    trajectory_from(R"(
kind = "explore"
num_legs = 20
area = [
  { east_m = 0.0, north_m = 0.0 },
  { east_m = 100.0, north_m = 0.0 },
  { east_m = 100.0, north_m = 90.0 },
]
)",
                    world);
  });
  EXPECT_NE(message.find("make the area larger"), std::string::npos) << message;
  const std::string legs = message_of(core::ErrorKind::Config, [&] {
    trajectory_from(exploration(1, "max_leg_m = 50.0\n"), world);
  });
  EXPECT_NE(legs.find("max_leg_m = 50"), std::string::npos) << legs;
}

}  // namespace
}  // namespace terracast::geo
