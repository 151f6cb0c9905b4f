#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using test::GroundWorld;
using test::message_of;
using test::trajectory_from;

/// Hills of 60 m, 700 m apart along x.
GroundWorld hilly_world() {
  GroundWorld world;
  world.ground = [frame = world.frame](double lat_deg, double lon_deg) -> std::optional<double> {
    const Eigen::Vector3d at = frame.world_from_geodetic({lat_deg, lon_deg, 1000.0});
    if (at.head<2>().cwiseAbs().maxCoeff() > 8000.0) return std::nullopt;
    return 1000.0 + 60.0 * std::sin(2.0 * std::numbers::pi * at.x() / 700.0);
  };
  return world;
}

/// East for 1200 m, and on to the north-east for 500 m.
const char* const kBend = R"(
kind = "corridor"
line = [
  { east_m = 0.0, north_m = 0.0 },
  { east_m = 1200.0, north_m = 0.0 },
  { east_m = 1550.0, north_m = 350.0 },
]
height_m = 90.0
follow_length_m = 50.0
)";

/// Distance of a place to a leg, on the map.
double distance_m(const Eigen::Vector2d& place, const Eigen::Vector2d& from,
                  const Eigen::Vector2d& to) {
  const Eigen::Vector2d leg = to - from;
  const double share = std::clamp((place - from).dot(leg) / leg.squaredNorm(), 0.0, 1.0);
  return (place - from - share * leg).norm();
}

TEST(Corridor, FliesAlongItsLineAtItsHeightAboveTheGround) {
  const GroundWorld world = hilly_world();
  for (const char* continuity : {"second", "fourth"}) {
    const auto motion =
        trajectory_from(fmt::format("{}continuity = \"{}\"\n", kBend, continuity), world);
    double lowest_m = 1e9, highest_m = 0.0, farthest_m = 0.0, steepest = 0.0;
    for (int i = 0; i <= 2000; ++i) {
      const MotionState state = motion->at(motion->duration_s() * i / 2000);
      const Eigen::Vector3d& at = state.world_from_body.translation;
      const double agl_m = test::agl_m(world, at);
      // Within follow_length_m of its ends the mean is of one side.
      const bool is_at_end = i < 100 || i > 1900;
      lowest_m = std::min(lowest_m, is_at_end ? lowest_m : agl_m);
      highest_m = std::max(highest_m, is_at_end ? highest_m : agl_m);
      farthest_m =
          std::max(farthest_m, std::min(distance_m(at.head<2>(), {0.0, 0.0}, {1200.0, 0.0}),
                                        distance_m(at.head<2>(), {1200.0, 0.0}, {1550.0, 350.0})));
      steepest = std::max(
          steepest, std::abs(state.velocity_world_mps.normalized().dot(world.frame.up_world(at))));
    }
    // The mean by a triangle of 50 m to both sides: 60 (2 pi / 700)^2 50^2 / 12 = 1 m; less than a decimetre is the spline's own.
    EXPECT_NEAR(lowest_m, 90.0, 1.5) << continuity;
    EXPECT_NEAR(highest_m, 90.0, 1.5) << continuity;
    // A circle of 52 m cuts a corner of 45 degrees by 52 (1 / cos 22.5 - 1) m.
    EXPECT_LT(farthest_m, 6.0);
    EXPECT_GT(farthest_m, 2.0);
    // 60 * 2 pi / 700
    EXPECT_NEAR(steepest, std::sin(std::atan(0.539)), 0.02);
  }
}

TEST(Corridor, ClimbsNoMoreThanItMay) {
  const GroundWorld world = hilly_world();
  const auto motion = trajectory_from(std::string(kBend) + "max_climb_deg = 12.0\n", world);
  double highest_m = 0.0;
  for (int i = 0; i <= 2000; ++i) {
    const MotionState state = motion->at(motion->duration_s() * i / 2000);
    const Eigen::Vector3d& at = state.world_from_body.translation;
    EXPECT_LT(std::abs(state.velocity_world_mps.normalized().dot(world.frame.up_world(at))),
              std::sin(12.0 * std::numbers::pi / 180.0));
    EXPECT_GT(test::agl_m(world, at), 85.0);
    highest_m = std::max(highest_m, test::agl_m(world, at));
  }
  EXPECT_GT(highest_m, 110.0);  // over valleys that it cannot follow
}

TEST(Corridor, LevelKeepsOneHeightAboveTheHighestGround) {
  const GroundWorld world = hilly_world();
  const auto motion = trajectory_from(std::string(kBend) + "profile = \"level\"\n", world);
  for (int i = 0; i <= 200; ++i) {
    const Eigen::Vector3d at =
        motion->at(motion->duration_s() * i / 200).world_from_body.translation;
    EXPECT_NEAR(world.frame.geodetic_from_world(at).height_m, 1060.0 + 90.0, 0.1);
  }
}

TEST(Corridor, FliesParallelLinesThereAndBack) {
  const GroundWorld world = hilly_world();
  const auto motion =
      trajectory_from(std::string(kBend) + "num_lines = 3\nline_spacing_m = 60.0\n", world);
  // The first and second pass of x = 600 m, and the third.
  std::vector<double> north_m;
  std::vector<bool> is_eastward;
  Eigen::Vector3d before = motion->at(0.0).world_from_body.translation;
  for (double time_s = 0.1; time_s <= motion->duration_s(); time_s += 0.1) {
    const Eigen::Vector3d at = motion->at(time_s).world_from_body.translation;
    if ((before.x() < 600.0) != (at.x() < 600.0)) {
      north_m.push_back(at.y());
      is_eastward.push_back(at.x() > before.x());
    }
    before = at;
  }
  ASSERT_EQ(north_m.size(), 3u);
  EXPECT_EQ(is_eastward, (std::vector<bool>{true, false, true}));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(north_m[i], 60.0 * (i - 1), 0.1);
}

TEST(Corridor, RefusesWhatCannotBeFlown) {
  const GroundWorld world = hilly_world();
  const auto message = [&](core::ErrorKind kind, const std::string& toml) {
    return message_of(kind, [&] { trajectory_from(toml, world); });
  };
  EXPECT_NE(message(core::ErrorKind::Config, std::string(kBend) + "speed_mps = 80.0\n")
                .find("is too short for the turns at its ends"),
            std::string::npos);
  EXPECT_NE(message(core::ErrorKind::Config,
                    "kind = \"corridor\"\nline = [{ east_m = 0.0, north_m = 0.0 }]\n")
                .find("line has 1 places"),
            std::string::npos);
  EXPECT_NE(message(core::ErrorKind::Config, R"(
kind = "corridor"
line = [{ east_m = 0.0, north_m = 0.0 }, { east_m = 0.0, north_m = 0.01 }])")
                .find("place 1 of the line (counted from 0) is where the one before it is"),
            std::string::npos);
  EXPECT_NE(message(core::ErrorKind::Input, R"(
kind = "corridor"
line = [{ east_m = 0.0, north_m = 0.0 }, { east_m = 9000.0, north_m = 0.0 }])")
                .find("no ground at"),
            std::string::npos);
  EXPECT_NE(message(core::ErrorKind::Config, std::string(kBend) + "min_agl_m = 100.0\n")
                .find("is more than height_m"),
            std::string::npos);
}

}  // namespace
}  // namespace terracast::geo
