#include "geo/vehicles/quadrotor.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/toml_reader.h"
#include "geo/gravity.h"
#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
using test::GroundWorld;
using test::kGravity_mps2;
using test::message_of;
using test::trajectory_from;

constexpr double kDegree = std::numbers::pi / 180.0;

/// A figure through four places about a place of the world, with further keys.
std::string flight_text(double east_m, double north_m, const std::string& more = "") {
  const auto place = [&](double east, double north, double height) {
    return fmt::format("  {{ east_m = {}, north_m = {}, height_m = {} }},\n", east_m + east,
                       north_m + north, height);
  };
  return "kind = \"quadrotor\"\nwaypoints = [\n" + place(0.0, 0.0, 30.0) + place(60.0, 20.0, 45.0) +
         place(80.0, 90.0, 25.0) + place(10.0, 70.0, 40.0) + "]\n" + more;
}

/// RotorS' Hummingbird.
constexpr const char* kVehicle = R"(
[vehicle]
mass_kg = 0.716
thrust_n_s2_per_rad2 = 8.54858e-6
drag_n_s2_per_rad_m = 8.06428e-5
max_rotor_radps = 838.0
)";

/// What an accelerometer in the body's middle measures, by the body's axes.
Vector3d specific_force(const GroundWorld& world, const MotionState& state) {
  const Vector3d& position = state.world_from_body.translation;
  return state.world_from_body.rotation.conjugate() *
         (state.acceleration_world_mps2 +
          2.0 * earth_rate_world_radps(world.frame).cross(state.velocity_world_mps) -
          gravity_world_mps2(world.frame, position));
}

TEST(Quadrotor, WithoutDragItsAccelerometerReadsNothingSideways) {
  const GroundWorld world;
  // In the middle, and where up leans by 0.22 degrees.
  for (const double east_m : {0.0, 25000.0}) {
    const auto motion = trajectory_from(flight_text(east_m, -2000.0), world);
    double most_mps2 = 0.0, least_up_mps2 = 1e9, largest_tilt_rad = 0.0;
    for (int i = 0; i <= 500; ++i) {
      const MotionState state = motion->at(motion->duration_s() * i / 500);
      const Vector3d force = specific_force(world, state);
      most_mps2 = std::max(most_mps2, force.head<2>().norm());
      least_up_mps2 = std::min(least_up_mps2, force.z());
      const Vector3d up = world.frame.up_world(state.world_from_body.translation);
      const Vector3d body_up = state.world_from_body.rotation * Vector3d::UnitZ();
      largest_tilt_rad = std::max(largest_tilt_rad, std::acos(body_up.dot(up)));
    }
    EXPECT_LT(most_mps2, 1e-9);
    EXPECT_GT(least_up_mps2, 5.0);
    EXPECT_GT(largest_tilt_rad, 5.0 * kDegree);
    // At rest the body stands by gravity: where the world's z leans, so does the body.
    const Vector3d resting = motion->at(0.0).world_from_body.rotation * Vector3d::UnitZ();
    EXPECT_NEAR(std::acos(std::min(1.0, resting.z())),
                std::atan(std::hypot(east_m, 2000.0) / 6.37e6), 2e-5);
  }
}

// With z along the thrust, drag is what is left sideways: -d times the velocity across z.
TEST(Quadrotor, WithDragItsAccelerometerReadsTheDragSideways) {
  const GroundWorld world;
  const auto motion = trajectory_from(flight_text(25000.0, 3000.0, kVehicle), world);
  const double drag_per_s =
      4.0 * 8.06428e-5 * std::sqrt(0.716 * kGravity_mps2 / (4.0 * 8.54858e-6)) / 0.716;
  double largest_mps2 = 0.0;
  for (int i = 0; i <= 500; ++i) {
    const MotionState state = motion->at(motion->duration_s() * i / 500);
    const Vector3d force = specific_force(world, state);
    const Vector3d velocity = state.world_from_body.rotation.conjugate() * state.velocity_world_mps;
    EXPECT_LT((force.head<2>() + drag_per_s * velocity.head<2>()).norm(), 1e-9);
    largest_mps2 = std::max(largest_mps2, force.head<2>().norm());
  }
  EXPECT_GT(largest_mps2, 1.0);
}

// In steady level flight weight, thrust and drag balance: tan(pitch) = d V / g, and the accelerometer reads g sin(pitch) forward, nothing left and
// g cos(pitch) up.
TEST(Quadrotor, InSteadyFlightLeansByDragOverGravity) {
  const GroundWorld world;
  const double drag_per_s = 0.3, speed_mps = 9.0;
  const Vector3d position(0.0, 0.0, 100.0), east = Vector3d::UnitX();
  const Vector3d zero = Vector3d::Zero();
  const LeastSnapCurve::Value motion{position, speed_mps * east, zero, zero, zero};
  const Turning turning = flat_turning(world.frame, motion, {east, zero, zero}, drag_per_s);
  // On the turning Earth gravity counts with Coriolis' force.
  const Vector3d weight = gravity_world_mps2(world.frame, position) -
                          2.0 * earth_rate_world_radps(world.frame).cross(motion.velocity);
  const double pitch_rad = std::atan(drag_per_s * speed_mps / -weight.z());
  const Vector3d force = turning.world_from_body.conjugate() * -weight;
  EXPECT_NEAR(pitch_rad / kDegree, 15.4, 0.1);
  const double along_mps2 = weight.norm() * std::sin(pitch_rad);
  // Coriolis' force is not quite across: 1e-4 of gravity.
  EXPECT_NEAR(force.x(), -along_mps2, 2e-3);
  EXPECT_NEAR(force.y(), 0.0, 2e-3);
  EXPECT_NEAR(force.z(), weight.norm() * std::cos(pitch_rad), 2e-3);
  const Vector3d velocity_body = turning.world_from_body.conjugate() * motion.velocity;
  EXPECT_NEAR(force.x(), -drag_per_s * velocity_body.x(), 1e-12);
  EXPECT_NEAR(force.y(), -drag_per_s * velocity_body.y(), 1e-12);
}

/// The azimuth of the body's x axis, clockwise from north.
double heading_deg(const GroundWorld& world, const MotionState& state) {
  const Vector3d nose_enu =
      world.frame.world_from_enu(state.world_from_body.translation).transpose() *
      (state.world_from_body.rotation * Vector3d::UnitX());
  return std::atan2(nose_enu.x(), nose_enu.y()) / kDegree;
}

TEST(Quadrotor, PointsItsNoseAlongThePathToAHeadingOrToAPlace) {
  const GroundWorld world;
  const auto expect_headings = [&](const std::string& keys, const auto& expected_enu_of) {
    const auto motion = trajectory_from(flight_text(9000.0, 4000.0, keys), world);
    for (int i = 10; i <= 190; ++i) {  // nearer to rest the velocity is rounded
      const MotionState state = motion->at(motion->duration_s() * i / 200);
      const Vector3d expected =
          world.frame.world_from_enu(state.world_from_body.translation).transpose() *
          expected_enu_of(state);
      const double difference =
          heading_deg(world, state) - std::atan2(expected.x(), expected.y()) / kDegree;
      ASSERT_NEAR(std::remainder(difference, 360.0), 0.0, 1e-7) << keys << i;
    }
  };
  expect_headings("", [](const MotionState& state) { return state.velocity_world_mps; });
  const Vector3d target = world.frame.world_from_geodetic({42.55, 1.62, 1020.0});
  expect_headings(
      "heading = \"point\"\nlook_at = [{ lat_deg = 42.55, lon_deg = 1.62, height_m = 20.0 }]\n",
      [&](const MotionState& state) -> Vector3d {
        return target - state.world_from_body.translation;
      });
  expect_headings("heading = \"fixed\"\nheading_deg = 100.0\n", [&](const MotionState& state) {
    return Vector3d(world.frame.world_from_enu(state.world_from_body.translation) *
                    Vector3d(std::sin(100.0 * kDegree), std::cos(100.0 * kDegree), 0.0));
  });
}

TEST(Quadrotor, KeepsItsLimitsAndPassesItsPlaces) {
  const GroundWorld world;
  const auto motion = trajectory_from(
      flight_text(0.0, 0.0, "max_speed_mps = 6.0\nmax_acceleration_mps2 = 3.0\n"), world);
  double speed = 0.0, acceleration = 0.0;
  for (int i = 0; i <= 20000; ++i) {
    const MotionState state = motion->at(motion->duration_s() * i / 20000);
    speed = std::max(speed, state.velocity_world_mps.norm());
    acceleration = std::max(acceleration, state.acceleration_world_mps2.norm());
  }
  EXPECT_LE(speed, 6.0 * (1.0 + 1e-9));
  EXPECT_LE(acceleration, 3.0 * (1.0 + 1e-9));
  EXPECT_GT(std::max(speed / 6.0, acceleration / 3.0), 0.9999);
  const std::vector<double> knots_s = motion->knots_s();
  ASSERT_EQ(knots_s.size(), 4u);
  const double east_m[] = {0.0, 60.0, 80.0, 10.0}, north_m[] = {0.0, 20.0, 90.0, 70.0};
  const double height_m[] = {30.0, 45.0, 25.0, 40.0};
  for (int i = 0; i < 4; ++i) {
    const Vector3d at = motion->at(knots_s[i]).world_from_body.translation;
    EXPECT_NEAR(at.x(), east_m[i], 1e-9);
    EXPECT_NEAR(at.y(), north_m[i], 1e-9);
    EXPECT_NEAR(test::agl_m(world, at), height_m[i], 1e-6);
  }
}

TEST(Quadrotor, AClosedFlightGoesRoundWithoutARest) {
  const GroundWorld world;
  const auto motion = trajectory_from(flight_text(0.0, 0.0, "closed = true\nlaps = 2.5\n"), world);
  const double lap_s = motion->duration_s() / 2.5;
  EXPECT_GT(motion->at(0.0).velocity_world_mps.norm(), 1.0);
  for (const double time_s : {0.0, 1.3, 0.7 * lap_s}) {
    const MotionState first = motion->at(time_s), next = motion->at(time_s + lap_s);
    EXPECT_LT((first.world_from_body.translation - next.world_from_body.translation).norm(), 1e-9);
    EXPECT_LT((first.angular_velocity_body_radps - next.angular_velocity_body_radps).norm(), 1e-9);
  }
  const MotionState before = motion->at(lap_s - 1e-7), after = motion->at(lap_s + 1e-7);
  EXPECT_LT((before.jerk_world_mps3 - after.jerk_world_mps3).norm(), 1e-4);
  EXPECT_LT(
      (before.angular_acceleration_body_radps2 - after.angular_acceleration_body_radps2).norm(),
      1e-4);
}

TEST(Quadrotor, SaysWhatIsWrongWithAFlight) {
  const GroundWorld world;
  const auto message = [&](ErrorKind kind, const std::string& toml) {
    return message_of(kind, [&] { trajectory_from(toml, world); });
  };
  const auto two = [](const std::string& first, const std::string& second,
                      const std::string& more = "") {
    return fmt::format("kind = \"quadrotor\"\nwaypoints = [{{{}}}, {{{}}}]\n{}", first, second,
                       more);
  };
  const std::string here = "east_m = 0.0, north_m = 0.0, height_m = 20.0";
  const std::string above = "east_m = 0.0, north_m = 0.0, height_m = 60.0";
  EXPECT_NE(
      message(ErrorKind::Config, two(here, here)).find("waypoint 1 (counted from 0) is where"),
      std::string::npos);
  // A climb straight up has no heading of its own, but may have another.
  EXPECT_NE(message(ErrorKind::Input, two(here, above)).find("is vertical or turns back on itself"),
            std::string::npos);
  EXPECT_NO_THROW(trajectory_from(two(here, above, "heading = \"fixed\"\n"), world));
  EXPECT_NE(message(ErrorKind::Input, two(here, "east_m = 90.0, north_m = 0.0, height_m = 20.0",
                                          "heading = \"point\"\nlook_at = [{ east_m = 40.0, "
                                          "north_m = 0.0, height_m = 0.0 }]\n"))
                .find("passes above or below the place"),
            std::string::npos);
  EXPECT_NE(message(ErrorKind::Input, two(here, "east_m = 90.0, north_m = 0.0, height_m = 3.0"))
                .find("3.0 m above the ground, less than min_agl_m = 5.0 m, at t = "),
            std::string::npos);
  EXPECT_NE(message(ErrorKind::Input, two(above, "east_m = 0.0, north_m = 3.0, height_m = 900.0",
                                          "heading = \"fixed\"\nmax_acceleration_mps2 = "
                                          "50.0\nmax_jerk_mps3 = 500.0\nmax_speed_mps = 200.0\n"))
                .find("would have to push down"),
            std::string::npos);
  EXPECT_NE(message(ErrorKind::Input, flight_text(0.0, 0.0, R"(
max_speed_mps = 100.0
max_acceleration_mps2 = 8.0
max_jerk_mps3 = 1000.0
[vehicle]
mass_kg = 1.2
thrust_n_s2_per_rad2 = 5e-6
max_rotor_radps = 800.0
)"))
                .find("needs a thrust of"),
            std::string::npos);
  // The Crazyflie's 3.16e-10, which is of rpm.
  EXPECT_NE(message(ErrorKind::Config, flight_text(0.0, 0.0, R"(
[vehicle]
mass_kg = 0.03
thrust_n_s2_per_rad2 = 3.16e-10
max_rotor_radps = 2500.0
)"))
                .find("not N/rpm^2"),
            std::string::npos);
  EXPECT_NE(message(ErrorKind::Config, flight_text(0.0, 0.0, "heading = \"point\"\n"))
                .find("look_at has 0 places"),
            std::string::npos);
  EXPECT_NE(message(ErrorKind::Config, flight_text(0.0, 0.0, "laps = 2.0\n")).find("closed = true"),
            std::string::npos);
}

TEST(Quadrotor, ShippedVehiclesHoverBelowTheirFastestRotors) {
  int num_sets = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(TERRACAST_SOURCE_DIR "/configs/vehicles")) {
    if (!test::is_set_of_rotors(entry.path())) continue;
    Quadrotor vehicle;
    core::TomlDocument::load(entry.path()).read(vehicle);
    EXPECT_NO_THROW(vehicle.validate()) << entry.path();
    EXPECT_GT(vehicle.max_thrust_mps2(), 1.5 * kGravity_mps2) << entry.path();
    EXPECT_LT(vehicle.max_thrust_mps2(), 12.0 * kGravity_mps2) << entry.path();
    EXPECT_GT(vehicle.drag_per_s(), 0.05) << entry.path();
    EXPECT_LT(vehicle.drag_per_s(), 1.0) << entry.path();
    ++num_sets;
  }
  EXPECT_GE(num_sets, 4);
}

}  // namespace
}  // namespace terracast::geo
