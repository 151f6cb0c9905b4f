#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using test::GroundWorld;
using test::message_of;
using test::trajectory_from;

/// A wall of 50 m towards the north-east, on ground that rises by a metre in ten to the north.
const char* const kWall = R"(
kind = "facade"
wall = [{ east_m = 200.0, north_m = 100.0 }, { east_m = 230.0, north_m = 140.0 }]
distance_m = 8.0
lowest_m = 5.0
highest_m = 17.0
row_spacing_m = 4.0
)";

/// The same without its spacing.
const char* const kSides = R"(
kind = "facade"
wall = [{ east_m = 200.0, north_m = 100.0 }, { east_m = 230.0, north_m = 140.0 }]
distance_m = 8.0
highest_m = 17.0
)";

GroundWorld sloping_world() {
  GroundWorld world;
  world.ground = [frame = world.frame](double lat_deg, double lon_deg) -> std::optional<double> {
    return 1000.0 + 0.1 * frame.world_from_geodetic({lat_deg, lon_deg, 1000.0}).y();
  };
  return world;
}

TEST(Facade, FliesLevelRowsAtItsDistanceAndLooksAtTheWall) {
  const GroundWorld world = sloping_world();
  for (const std::string side : {"left", "right"})
    for (const std::string continuity : {"second", "fourth"}) {
      const auto motion = trajectory_from(
          fmt::format("{}side = \"{}\"\ncontinuity = \"{}\"\n", kWall, side, continuity), world);
      const double to_left = side == "left" ? 1.0 : -1.0;
      const Eigen::Vector2d ahead(0.6, 0.8), away(-0.8 * to_left, 0.6 * to_left);
      double least_m = 1e9, most_m = 0.0;
      std::vector<double> rows;
      for (int i = 0; i <= 3000; ++i) {
        const MotionState state = motion->at(motion->duration_s() * i / 3000);
        const Eigen::Vector3d& at = state.world_from_body.translation;
        const Eigen::Vector2d from_end = at.head<2>() - Eigen::Vector2d(200.0, 100.0);
        ASSERT_NEAR(from_end.dot(away), 8.0, 1e-6);
        ASSERT_GT(from_end.dot(ahead), -2.1);
        ASSERT_LT(from_end.dot(ahead), 52.1);
        const Eigen::Vector3d nose = state.world_from_body.rotation * Eigen::Vector3d::UnitX();
        ASSERT_LT((nose.head<2>() + away).norm(), 1e-4);  // up leans by 4e-5 here
        ASSERT_NEAR(state.velocity_world_mps.norm(), 2.0, 1e-9);
        const double height_m = world.frame.geodetic_from_world(at).height_m;
        least_m = std::min(least_m, height_m);
        most_m = std::max(most_m, height_m);
        if (std::abs(from_end.dot(ahead) - 25.0) < 0.02) rows.push_back(height_m);
      }
      EXPECT_NEAR(most_m - least_m, 12.0, 0.01);
      // Below the wall's northern end, and up to 2 m beyond in turns.
      const double highest_ground_m = 1000.0 + 0.1 * (140.0 + 8.0 * away.y());
      EXPECT_NEAR(least_m, highest_ground_m + 5.0, 0.2);
      std::sort(rows.begin(), rows.end());
      ASSERT_GE(rows.size(), 4u);
      for (const double row_m : rows) EXPECT_NEAR(std::remainder(row_m - least_m, 4.0), 0.0, 0.01);
    }
}

TEST(Facade, TurnsAboutAsGentlyAsItSays) {
  const GroundWorld world = sloping_world();
  for (const double spacing_m : {1.0, 2.0, 4.0}) {
    // The fastest that is flown: 5 m/s^2 round half circles between the rows.
    const double speed_mps = std::sqrt(0.999 * 5.0 * 0.5 * spacing_m);
    const auto motion =
        trajectory_from(fmt::format("{}lowest_m = 5.0\nrow_spacing_m = {}\nspeed_mps = {}\n",
                                    kSides, spacing_m, speed_mps),
                        world);
    double most_mps2 = 0.0;
    for (int i = 0; i <= 20000; ++i)
      most_mps2 = std::max(
          most_mps2, motion->at(motion->duration_s() * i / 20000).acceleration_world_mps2.norm());
    EXPECT_GT(most_mps2, 5.0);
    EXPECT_LT(most_mps2, spacing_m < 1.5 ? 6.6 : 5.4);
  }
}

TEST(Facade, RefusesWhatCannotBeFlown) {
  const GroundWorld world = sloping_world();
  const auto message = [&](core::ErrorKind kind, const std::string& toml) {
    return message_of(kind, [&] { trajectory_from(toml, world); });
  };
  EXPECT_NE(message(core::ErrorKind::Config, "kind = \"facade\"\n").find("wall has 0 places"),
            std::string::npos);
  EXPECT_NE(message(core::ErrorKind::Config, std::string(kWall) + "speed_mps = 6.0\n")
                .find("fly at 3.16 m/s"),
            std::string::npos);
  // The advised speed is flown.
  for (const double spacing_m : {1.5, 2.0, 3.0, 7.0}) {
    const auto keys = [&](const std::string& speed) {
      return fmt::format("{}lowest_m = 5.0\nrow_spacing_m = {}\nspeed_mps = {}\n", kSides,
                         spacing_m, speed);
    };
    const std::string refused = message(core::ErrorKind::Config, keys("50.0"));
    const std::size_t at = refused.find("fly at ") + 7;
    trajectory_from(keys(refused.substr(at, refused.find(" m/s", at) - at)), world);
  }
  const std::string too_low =
      message(core::ErrorKind::Input, std::string(kWall) + "min_agl_m = 9.0\n");
  EXPECT_NE(too_low.find("raise lowest_m"), std::string::npos) << too_low;
  EXPECT_EQ(too_low.find("terrain_following"), std::string::npos) << too_low;
  EXPECT_NE(message(core::ErrorKind::Config, std::string(kSides) + "lowest_m = 16.5\n")
                .find("are 0.50 m apart; 1 m are flown at least"),
            std::string::npos);
  EXPECT_NE(message(core::ErrorKind::Config, R"(
kind = "facade"
wall = [{ east_m = 200.0, north_m = 100.0 }, { east_m = 200.0, north_m = 100.2 }])")
                .find("the wall is 0.200 m long"),
            std::string::npos);
}

}  // namespace
}  // namespace terracast::geo
