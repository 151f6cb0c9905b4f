#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tests/geo/trajectory_support.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

using test::GroundWorld;
using test::kFourPlaces;
using test::kGravity_mps2;
using test::message_of;
using test::options_from;
using test::trajectory_from;

/// Least distance of the motion to a point, by a fine walk.
double nearest_m(const Trajectory& motion, const Eigen::Vector3d& point) {
  double best = 1e30, best_time = 0.0;
  const int count = 2000;
  for (int i = 0; i <= count; ++i) {
    const double time_s = motion.duration_s() * i / count;
    const double d = (motion.at(time_s).world_from_body.translation - point).norm();
    if (d < best) {
      best = d;
      best_time = time_s;
    }
  }
  double width_s = motion.duration_s() / count;
  for (int round = 0; round < 50; ++round) {
    for (const double t : {best_time - width_s, best_time + width_s}) {
      const double time_s = std::clamp(t, 0.0, motion.duration_s());
      const double d = (motion.at(time_s).world_from_body.translation - point).norm();
      if (d < best) {
        best = d;
        best_time = time_s;
      }
    }
    width_s *= 0.7;
  }
  return best;
}

TEST(Waypoints, PassThroughEveryPlaceAtConstantSpeed) {
  const GroundWorld world;
  const auto motion = trajectory_from(kFourPlaces, world);
  for (const Geodetic& place : {Geodetic{42.50, 1.50, 1100.0}, Geodetic{42.52, 1.52, 1300.0},
                                Geodetic{42.51, 1.56, 1150.0}, Geodetic{42.54, 1.58, 1400.0}}) {
    EXPECT_LT(nearest_m(*motion, world.frame.world_from_geodetic(place)), 1e-3);
  }
  double travelled_m = 0.0;
  Eigen::Vector3d before = motion->at(0.0).world_from_body.translation;
  for (int i = 1; i <= 5000; ++i) {
    const BodyState state = motion->at(motion->duration_s() * i / 5000);
    ASSERT_NEAR(state.velocity_world_mps.norm(), 25.0, 1e-9);
    travelled_m += (state.world_from_body.translation - before).norm();
    before = state.world_from_body.translation;
  }
  EXPECT_NEAR(travelled_m, 25.0 * motion->duration_s(), 0.01);  // chords are a little shorter
}

TEST(Waypoints, LevelPlacesFarApartAreJoinedLevelOverTheCurvedEarth) {
  const GroundWorld world;
  const auto motion = trajectory_from(R"(
kind = "waypoints"
speed_mps = 100.0
waypoints = [
  { east_m = -20000.0, north_m = -15000.0, height_m = 200.0 },
  { east_m = 20000.0, north_m = 18000.0, height_m = 200.0 },
]
)",
                                      world);
  for (int i = 0; i <= 100; ++i) {
    // A straight chord would dip 210 m; 5 cm are left of the third order.
    ASSERT_NEAR(
        test::agl_m(world, motion->at(motion->duration_s() * i / 100).world_from_body.translation),
        200.0, 0.1);
  }
}

TEST(Waypoints, ReachTheirOwnSpeeds) {
  const GroundWorld world;
  const auto motion = trajectory_from(R"(
kind = "waypoints"
speed_mps = 10.0
waypoints = [
  { east_m = 0.0, north_m = 0.0, height_m = 100.0 },
  { east_m = 300.0, north_m = 0.0, height_m = 100.0, speed_mps = 20.0 },
  { east_m = 600.0, north_m = 0.0, height_m = 100.0 },
]
)",
                                      world);
  EXPECT_NEAR(motion->duration_s(), 2.0 * 300.0 / 15.0, 0.01);
  EXPECT_NEAR(motion->at(0.0).velocity_world_mps.norm(), 10.0, 1e-9);
  EXPECT_NEAR(motion->at(motion->duration_s() / 2).velocity_world_mps.norm(), 20.0, 1e-9);
  EXPECT_NEAR(motion->at(motion->duration_s() / 4).velocity_world_mps.norm(), 15.0, 1e-6);
  EXPECT_NEAR(motion->at(motion->duration_s()).velocity_world_mps.norm(), 10.0, 1e-9);
}

TEST(Waypoints, AccelerationIsContinuousAtTheKnots) {
  const GroundWorld world;
  const auto motion = trajectory_from(kFourPlaces, world);
  const Eigen::Vector3d knot = world.frame.world_from_geodetic({42.52, 1.52, 1300.0});
  // When the knot is passed, by bisection of the distance's derivative.
  double low_s = 0.05 * motion->duration_s(), high_s = 0.6 * motion->duration_s();
  for (int i = 0; i < 80; ++i) {
    const double middle_s = 0.5 * (low_s + high_s);
    const BodyState state = motion->at(middle_s);
    const bool is_before =
        (knot - state.world_from_body.translation).dot(state.velocity_world_mps) > 0;
    (is_before ? low_s : high_s) = middle_s;
  }
  const double knot_s = low_s;
  ASSERT_LT((motion->at(knot_s).world_from_body.translation - knot).norm(), 1e-3);
  for (const double step_s : {0.1, 0.01, 0.001}) {
    const auto acceleration = [&](double from_s) -> Eigen::Vector3d {
      return (motion->at(from_s + step_s).velocity_world_mps -
              motion->at(from_s).velocity_world_mps) /
             step_s;
    };
    // Third derivatives are bounded, so both sides meet in proportion to the step.
    EXPECT_LT((acceleration(knot_s) - acceleration(knot_s - step_s)).norm(), 1.0 * step_s + 1e-6);
  }
}

TEST(Waypoints, AClosedPathIsSmoothWhereItReturns) {
  const GroundWorld world;
  const auto motion = trajectory_from(R"(
kind = "waypoints"
closed = true
laps = 2.0
waypoints = [
  { east_m = 0.0, north_m = 0.0, height_m = 100.0 },
  { east_m = 400.0, north_m = -50.0, height_m = 140.0, speed_mps = 25.0 },
  { east_m = 500.0, north_m = 300.0, height_m = 120.0 },
  { east_m = 50.0, north_m = 350.0, height_m = 90.0 },
]
)",
                                      world);
  const double lap_s = motion->duration_s() / 2;
  constexpr double kStep_s = 1e-4;
  const BodyState before = motion->at(lap_s - kStep_s);
  const BodyState after = motion->at(lap_s + kStep_s);
  EXPECT_LT((after.world_from_body.translation - before.world_from_body.translation -
             2 * kStep_s * motion->at(lap_s).velocity_world_mps)
                .norm(),
            1e-7);
  EXPECT_LT((after.velocity_world_mps - before.velocity_world_mps).norm(), 20.0 * kStep_s);
  EXPECT_LT((after.angular_velocity_body_radps - before.angular_velocity_body_radps).norm(), 0.01);
  EXPECT_GT(after.world_from_body.rotation.dot(before.world_from_body.rotation), 1.0 - 1e-7);
}

TEST(Waypoints, BankFollowsTheCurvatureOfTheirPath) {
  const GroundWorld world;
  const auto motion = trajectory_from(std::string(kFourPlaces) + "bank_smoothing_s = 0.5\n", world);
  constexpr double kStep_s = 0.01;
  double most_rad = 0.0;
  for (int i = 1; i < 200; ++i) {
    const double time_s = motion->duration_s() * i / 200;
    const BodyState state = motion->at(time_s);
    const Eigen::Vector3d acceleration = (motion->at(time_s + kStep_s).velocity_world_mps -
                                          motion->at(time_s - kStep_s).velocity_world_mps) /
                                         (2 * kStep_s);
    const Eigen::Vector3d up = world.frame.up_world(state.world_from_body.translation);
    const Eigen::Vector3d left = up.cross(state.velocity_world_mps).normalized();
    const double expected = -std::atan(acceleration.dot(left) / kGravity_mps2);
    // Half a second of averaging over curvature that changes within tens of seconds.
    ASSERT_NEAR(test::roll_rad(world, state), expected, 0.003) << time_s;
    most_rad = std::max(most_rad, std::abs(expected));
  }
  EXPECT_GT(most_rad, 0.02);
}

TEST(Waypoints, CanFlyWithALevelNose) {
  const GroundWorld world;
  const auto motion = trajectory_from(std::string(kFourPlaces) + "pitch = \"level\"\n", world);
  constexpr double kStep_s = 1e-3;
  for (int i = 1; i < 50; ++i) {
    const double time_s = motion->duration_s() * i / 50;
    const BodyState state = motion->at(time_s);
    const Eigen::Vector3d up = world.frame.up_world(state.world_from_body.translation);
    const Eigen::Matrix3d axes = state.world_from_body.rotation.toRotationMatrix();
    ASSERT_NEAR(axes.col(0).dot(up), 0.0, 1e-12);
    const Eigen::Matrix3d skew =
        axes.transpose() *
        (motion->at(time_s + kStep_s).world_from_body.rotation.toRotationMatrix() -
         motion->at(time_s - kStep_s).world_from_body.rotation.toRotationMatrix()) /
        (2 * kStep_s);
    ASSERT_LT(
        (Eigen::Vector3d(skew(2, 1), skew(0, 2), skew(1, 0)) - state.angular_velocity_body_radps)
            .norm(),
        1e-5);
  }
}

TEST(Waypoints, HeightsAboveTheGeoidUseIt) {
  if (!std::filesystem::exists("/usr/share/proj/egm96_15.gtx"))
    GTEST_SKIP() << "egm96_15.gtx is missing: install proj-data";
  const terracast::test::ScratchFolder scratch;
  const GroundWorld world;
  TrajectoryContext context = world.context();
  context.geoid = Geoid::egm96("/usr/share/proj/egm96_15.gtx", scratch.path());
  const char* text = R"(
kind = "waypoints"
waypoints = [
  { lat_deg = 42.50, lon_deg = 1.50, height_m = 1500.0, above = "egm96" },
  { lat_deg = 42.52, lon_deg = 1.52, height_m = 1500.0, above = "egm96" },
]
)";
  const auto motion = options_from(text).kind_options().build(context);
  const Geodetic start =
      world.frame.geodetic_from_world(motion->at(0.0).world_from_body.translation);
  EXPECT_NEAR(start.height_m, 1500.0 + context.geoid->undulation_m(42.5, 1.5), 1e-6);
  EXPECT_GT(start.height_m, 1540.0);  // some 50 m in the Pyrenees
  const std::string message =
      message_of(core::ErrorKind::Config, [&] { trajectory_from(text, world); });
  EXPECT_NE(message.find("geoid"), std::string::npos);
}

/// A ridge of 600 m across the way, 2 km wide, and small steps on it.
GroundWorld ridge_world() {
  GroundWorld world;
  world.ground = [frame = world.frame](double lat_deg, double lon_deg) -> std::optional<double> {
    const Eigen::Vector3d at = frame.world_from_geodetic({lat_deg, lon_deg, 1000.0});
    if (at.head<2>().norm() > 20000.0) return std::nullopt;
    const double x = (at.x() - 3000.0) / 1000.0;
    const double ridge_m = std::abs(x) < 1.0 ? 300.0 * (1.0 + std::cos(std::numbers::pi * x)) : 0.0;
    return 1000.0 + ridge_m + (std::fmod(std::abs(at.x()), 60.0) < 30.0 ? 4.0 : 0.0);
  };
  return world;
}

const char* const kOverTheRidge = R"(
kind = "waypoints"
speed_mps = 30.0
min_agl_m = 80.0
waypoints = [
  { east_m = 0.0, north_m = 0.0, height_m = 120.0 },
  { east_m = 6000.0, north_m = 500.0, height_m = 120.0 },
]
)";

TEST(Ground, APathThroughARidgeIsRefusedWithThePlaceAndTheDepth) {
  const GroundWorld world = ridge_world();
  const std::string message =
      message_of(core::ErrorKind::Input, [&] { trajectory_from(kOverTheRidge, world); });
  // 480 m deep in the middle of the ridge, after 3000 m at 30 m/s.
  EXPECT_NE(message.find("below the ground at t = 10"), std::string::npos) << message;
  EXPECT_NE(message.find("m below the ground"), std::string::npos) << message;
  EXPECT_NE(message.find("raise waypoint 0 or 1 (counted from 0), or add one between"),
            std::string::npos)
      << message;
  EXPECT_NE(message.find("terrain_following"), std::string::npos) << message;
  double depth_m = 0.0;
  ASSERT_EQ(std::sscanf(message.c_str(), "the path is %lf m below", &depth_m), 1) << message;
  EXPECT_NEAR(depth_m, 1000.0 + 600.0 + 4.0 - 1124.0, 4.1);
}

TEST(Ground, TerrainFollowingKeepsTheLeastHeightAndStaysSmooth) {
  const GroundWorld world = ridge_world();
  const auto motion =
      trajectory_from(std::string(kOverTheRidge) + "terrain_following = true\n", world);
  double least_m = 1e9, most_m = 0.0, most_acceleration = 0.0;
  const int count = 20000;
  for (int i = 0; i <= count; ++i) {
    const BodyState state = motion->at(motion->duration_s() * i / count);
    const double agl_m = test::agl_m(world, state.world_from_body.translation);
    least_m = std::min(least_m, agl_m);
    most_m = std::max(most_m, agl_m);
    ASSERT_NEAR(state.velocity_world_mps.norm(), 30.0, 1e-8);
    if (i > 0) {
      const BodyState before = motion->at(motion->duration_s() * (i - 1) / count);
      most_acceleration = std::max(most_acceleration,
                                   (state.velocity_world_mps - before.velocity_world_mps).norm() /
                                       (motion->duration_s() / count));
    }
  }
  // Samples every 5 m see each step of the ground but not its very edge.
  EXPECT_GT(least_m, 80.0 - 4.1);
  EXPECT_LT(most_m, 500.0);            // it comes down again behind the ridge
  EXPECT_LT(most_acceleration, 12.0);  // no kinks: about one g in the pull-up
  // What was high enough is not touched: far from the ridge the path is the straight one.
  EXPECT_NEAR(test::agl_m(world, motion->at(0.0).world_from_body.translation), 120.0, 1e-6);
}

TEST(Ground, ATooSteepPathIsRefused) {
  const GroundWorld world = ridge_world();
  const std::string message = message_of(core::ErrorKind::Input, [&] {
    trajectory_from(std::string(kOverTheRidge) + "terrain_following = true\nmax_climb_deg = 10.0\n",
                    world);
  });
  EXPECT_NE(message.find("max_climb_deg = 10.0"), std::string::npos) << message;
  EXPECT_NE(message.find("lat 42."), std::string::npos) << message;
}

TEST(Ground, APathJustAtTheLeastHeightIsFlown) {
  const GroundWorld world;
  const auto motion = trajectory_from(R"(
kind = "waypoints"
min_agl_m = 50.0
waypoints = [
  { east_m = 0.0, north_m = 0.0, height_m = 50.0 },
  { east_m = 1000.0, north_m = 500.0, height_m = 50.0 },
]
)",
                                      world);
  EXPECT_GT(motion->duration_s(), 70.0);
}

TEST(Ground, AWaypointOutsideTheWorldIsNamed) {
  const GroundWorld world = ridge_world();
  const std::string message = message_of(core::ErrorKind::Input, [&] {
    trajectory_from(R"(
kind = "waypoints"
waypoints = [
  { east_m = 0.0, north_m = 0.0, height_m = 120.0 },
  { east_m = 0.0, north_m = 25000.0, height_m = 120.0 },
]
)",
                    world);
  });
  EXPECT_NE(message.find("waypoint 1 (counted from 0)"), std::string::npos) << message;
  EXPECT_NE(message.find("no ground at lat 42.7"), std::string::npos) << message;
}

}  // namespace
}  // namespace terracast::geo
