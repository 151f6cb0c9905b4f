#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/atomic_file.h"
#include "core/toml_reader.h"
#include "geo/units.h"
#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using test::GroundWorld;
using test::kGravity_mps2;
using test::orbit_text;
using test::trajectory_from;

TEST(ShippedTrajectories, AreFlownOverLevelGround) {
  const GroundWorld world;
  int num_flown = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(TERRACAST_SOURCE_DIR "/configs/trajectories")) {
    const std::string text = core::read_text_file(entry.path());
    // Recordings are not at hand here, and other heights are of another place's ground.
    const auto names = [&](const char* word) { return text.find(word) != std::string::npos; };
    if (names("${data}") || names("egm96") || names("ellipsoid")) continue;
    TrajectoryOptions options;
    core::TomlDocument::load(entry.path()).read(options);
    EXPECT_NO_THROW(options.validate()) << entry.path();
    EXPECT_NO_THROW(sample_frames(options, world.context())) << entry.path();
    ++num_flown;
  }
  EXPECT_GE(num_flown, 4);
}

TEST(Orbit, BanksByTheClosedFormOfACoordinatedTurn) {
  const GroundWorld world;
  for (const char* direction : {"left", "right"}) {
    const double radius_m = 180.0, speed_mps = 22.0;
    const auto motion = trajectory_from(
        orbit_text(radius_m, speed_mps, fmt::format("direction = \"{}\"", direction)), world);
    EXPECT_NEAR(motion->duration_s(), 2 * std::numbers::pi * radius_m / speed_mps, 1e-8);
    const double expected = std::atan(speed_mps * speed_mps / (radius_m * kGravity_mps2));
    const double sign = std::string(direction) == "left" ? -1.0 : 1.0;  // the inner wing goes down
    for (int i = 0; i <= 50; ++i) {
      const BodyState state = motion->at(motion->duration_s() * i / 50);
      // The circle's plane is level at its centre; 180 m away up leans by 3e-5 rad.
      ASSERT_NEAR(test::roll_rad(world, state), sign * expected, 1e-6) << direction;
      ASSERT_NEAR(state.velocity_world_mps.norm(), speed_mps, 1e-9);
      ASSERT_NEAR(state.angular_velocity_body_radps.norm(), speed_mps / radius_m, 1e-6);
    }
  }
}

TEST(Orbit, KeepsWithinTheBankLimitAndFliesFlatWithoutBank) {
  const GroundWorld world;
  // atan(30^2 / (100 g)) is 42.5 deg.
  const auto limited = trajectory_from(orbit_text(100.0, 30.0, "max_bank_deg = 20.0"), world);
  EXPECT_NEAR(degrees_from_radians(test::roll_rad(world, limited->at(3.0))), -20.0, 1e-9);
  const auto flat = trajectory_from(orbit_text(100.0, 30.0, "bank = \"none\""), world);
  EXPECT_NEAR(test::roll_rad(world, flat->at(3.0)), 0.0, 1e-12);
}

TEST(Orbit, IsACircleAtTheHeightOfItsCentre) {
  const GroundWorld world;
  const double radius_m = 2000.0;
  const auto motion =
      trajectory_from(orbit_text(radius_m, 40.0, "start_azimuth_deg = 90.0\nlaps = 1.25"), world);
  const Eigen::Vector3d centre =
      world.frame.world_from_geodetic(world.frame.geodetic_from_world({12000.0, 9000.0, -18.0}));
  const Eigen::Matrix3d world_from_enu = world.frame.world_from_enu(centre);
  for (int i = 0; i <= 40; ++i) {
    const BodyState state = motion->at(motion->duration_s() * i / 40);
    const Eigen::Vector3d offset =
        world_from_enu.transpose() * (state.world_from_body.translation - centre);
    ASSERT_NEAR(offset.head<2>().norm(), radius_m, 1.0);  // the centre's height is not exact here
    // The ellipsoid's two curvatures part by 1 mm at 2 km.
    ASSERT_NEAR(test::agl_m(world, state.world_from_body.translation), 300.0, 0.003);
  }
  const Eigen::Vector3d start =
      world_from_enu.transpose() * (motion->at(0.0).world_from_body.translation - centre);
  EXPECT_NEAR(start.x(), radius_m, 1.0);  // azimuth 90: east
  EXPECT_NEAR(start.y(), 0.0, 1.0);
  EXPECT_GT((world_from_enu.transpose() * motion->at(0.0).velocity_world_mps).y(),
            39.9);  // left turn
  const double lap_s = motion->duration_s() / 1.25;
  EXPECT_LT(
      (motion->at(0.0).world_from_body.translation - motion->at(lap_s).world_from_body.translation)
          .norm(),
      1e-9);
  EXPECT_LT((motion->at(0.2 * lap_s).world_from_body.translation -
             motion->at(1.2 * lap_s).world_from_body.translation)
                .norm(),
            1e-8);
}

TEST(Orbit, CanFaceItsCentre) {
  const GroundWorld world;
  const auto motion = trajectory_from(orbit_text(250.0, 10.0, "face = \"centre\""), world);
  constexpr double kStep_s = 1e-3;
  for (int i = 1; i < 20; ++i) {
    const double time_s = motion->duration_s() * i / 20;
    const BodyState state = motion->at(time_s);
    const Eigen::Matrix3d axes = state.world_from_body.rotation.toRotationMatrix();
    const Eigen::Vector3d up = world.frame.up_world(state.world_from_body.translation);
    EXPECT_NEAR(axes.col(0).dot(up), 0.0, 1e-12);
    EXPECT_NEAR(axes.col(2).dot(up), 1.0, 1e-12);
    EXPECT_NEAR(axes.col(0).dot(state.velocity_world_mps), 0.0, 1e-3);
    EXPECT_NEAR(axes.col(1).dot(state.velocity_world_mps), -10.0,
                1e-3);  // left turn: centre at left
    const Eigen::Matrix3d rate =
        (motion->at(time_s + kStep_s).world_from_body.rotation.toRotationMatrix() -
         motion->at(time_s - kStep_s).world_from_body.rotation.toRotationMatrix()) /
        (2 * kStep_s);
    const Eigen::Matrix3d skew = axes.transpose() * rate;
    EXPECT_NEAR(skew(1, 0), state.angular_velocity_body_radps.z(), 1e-7);
  }
}

TEST(Forward, FliesAlongItsHeadingAtItsHeight) {
  const GroundWorld world;
  const auto motion = trajectory_from(R"(
kind = "forward"
start = { lat_deg = 42.6, lon_deg = 1.7, height_m = 50.0 }
heading_deg = 135.0
length_m = 3000.0
sway_side_m = 0.0
sway_height_m = 0.0
speed_mps = 15.0
)",
                                      world);
  // The line is straight over a curved Earth: longer by the height over its radius.
  EXPECT_NEAR(motion->duration_s(), 3000.0 / 15.0, 0.1);
  const BodyState first = motion->at(0.0);
  const Geodetic start = world.frame.geodetic_from_world(first.world_from_body.translation);
  EXPECT_NEAR(start.lat_deg, 42.6, 1e-12);
  EXPECT_NEAR(start.lon_deg, 1.7, 1e-12);
  const Eigen::Matrix3d world_from_enu =
      world.frame.world_from_enu(first.world_from_body.translation);
  const Eigen::Vector3d ahead = world_from_enu.transpose() * first.velocity_world_mps;
  EXPECT_NEAR(degrees_from_radians(std::atan2(ahead.x(), ahead.y())), 135.0, 0.001);
  for (int i = 0; i <= 30; ++i) {
    // Heights follow the Earth's curve to the third order of 20 km.
    ASSERT_NEAR(
        test::agl_m(world, motion->at(motion->duration_s() * i / 30).world_from_body.translation),
        50.0, 0.05);
  }
}

TEST(Forward, SwaysByItsAmplitudes) {
  const GroundWorld world;
  const auto motion = trajectory_from(R"(
kind = "forward"
start = { east_m = 0.0, north_m = 0.0, height_m = 50.0 }
heading_deg = 90.0
length_m = 600.0
sway_side_m = 3.0
sway_side_period_s = 10.0
sway_height_m = 2.0
sway_height_period_s = 8.0
)",
                                      world);
  double most_side = 0.0, most_height = 0.0;
  for (int i = 0; i <= 4000; ++i) {
    const Eigen::Vector3d at =
        motion->at(motion->duration_s() * i / 4000).world_from_body.translation;
    most_side = std::max(most_side, std::abs(at.y()));
    most_height = std::max(most_height, std::abs(test::agl_m(world, at) - 50.0));
  }
  EXPECT_NEAR(most_side, 3.0, 1e-3);
  EXPECT_NEAR(most_height, 2.0, 1e-3);
}

TEST(Loop, ReturnsToItsStartAndSpansItsExtents) {
  const GroundWorld world;
  for (const double roundness : {0.0, 0.5, 1.0}) {
    const auto motion = trajectory_from(fmt::format(R"(
kind = "loop"
start = {{ east_m = 0.0, north_m = 0.0, height_m = 60.0 }}
heading_deg = 0.0
length_m = 400.0
width_m = 200.0
height_change_m = 30.0
roundness = {}
laps = 1.0
)",
                                                    roundness),
                                        world);
    const BodyState first = motion->at(0.0);
    const BodyState last = motion->at(motion->duration_s());
    EXPECT_LT((first.world_from_body.translation - last.world_from_body.translation).norm(), 1e-8);
    EXPECT_GT(first.world_from_body.rotation.dot(last.world_from_body.rotation), 1.0 - 1e-12);
    EXPECT_LT((first.velocity_world_mps - last.velocity_world_mps).norm(), 1e-9);
    Eigen::AlignedBox3d extent;
    double highest_m = 0.0;
    for (int i = 0; i <= 2000; ++i) {
      const Eigen::Vector3d at =
          motion->at(motion->duration_s() * i / 2000).world_from_body.translation;
      extent.extend(at);
      highest_m = std::max(highest_m, test::agl_m(world, at));
    }
    // Heading north and turning left: 400 m from south to north, 200 m to the west.
    EXPECT_NEAR(extent.sizes().y(), 400.0, roundness < 1.0 ? 8.0 : 0.01);
    EXPECT_NEAR(extent.min().x(), -200.0, roundness < 1.0 ? 4.0 : 0.01);
    EXPECT_LT(extent.max().x(), 1e-3 + (roundness < 1.0 ? 4.0 : 0.0));
    EXPECT_NEAR(highest_m, 90.0, 0.02);
    if (roundness == 1.0) {
      // Ramanujan's perimeter of an ellipse, stretched by the climb: 2 parts in 10^4 more.
      const double a = 200.0, b = 100.0;
      const double perimeter_m =
          std::numbers::pi * (3 * (a + b) - std::sqrt((3 * a + b) * (a + 3 * b)));
      EXPECT_NEAR(motion->duration_s() * 15.0, perimeter_m, 0.003 * perimeter_m);
    }
  }
}

}  // namespace
}  // namespace terracast::geo
