// Flights of fixed-wing aircraft along planned paths: exactly, and by a controller in the wind.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/toml_reader.h"
#include "geo/gravity.h"
#include "geo/vehicles/flat_wing.h"
#include "geo/vehicles/flown_wing.h"
#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
using test::GroundWorld;
using test::message_of;
using test::trajectory_from;
using WingState = FixedWingDynamics::State;

constexpr const char* kAerosonde = "aerosonde_beard_mclain.toml";
constexpr const char* kZagi = "zagi_beard_mclain.toml";

FixedWing shipped_wing(const std::string& name) {
  FixedWing vehicle;
  core::TomlDocument::load(TERRACAST_SOURCE_DIR "/configs/vehicles/" + name).read(vehicle);
  return vehicle;
}

/// An S of wide turns with a climb, about 150 m above the ground.
std::string wing_text(const std::string& vehicle, const std::string& keys,
                      const std::string& tables = "", double scale = 1.0) {
  return fmt::format(R"(kind = "fixed_wing"
vehicle = "{}/configs/vehicles/{}"
{}
waypoints = [
  {{ east_m = 900.0, north_m = 400.0, height_m = 150.0 }},
  {{ east_m = {}, north_m = 420.0, height_m = 155.0 }},
  {{ east_m = {}, north_m = {}, height_m = 170.0 }},
  {{ east_m = {}, north_m = {}, height_m = 165.0 }},
]
{})",
                     TERRACAST_SOURCE_DIR, vehicle, keys, 900.0 + 300.0 * scale,
                     900.0 + 500.0 * scale, 420.0 + 200.0 * scale, 900.0 + 800.0 * scale,
                     420.0 + 260.0 * scale, tables);
}

std::string straight_text(const std::string& vehicle, const std::string& keys,
                          const std::string& tables = "", double climb_m = 0.0) {
  return fmt::format(R"(kind = "fixed_wing"
vehicle = "{}/configs/vehicles/{}"
{}
waypoints = [
  {{ east_m = 0.0, north_m = 0.0, height_m = 150.0 }},
  {{ east_m = 600.0, north_m = 0.0, height_m = {} }},
]
{})",
                     TERRACAST_SOURCE_DIR, vehicle, keys, 150.0 + climb_m, tables);
}

// --- Coordinated flight -------------------------------------------------------------------------

// The model's own forces on the pose against the motion that was asked for, and the bank against
// tan(bank) = (V^2 / R + Coriolis) / (g - Coriolis).
TEST(CoordinatedFlight, HasTheForcesOfItsMotion) {
  const GroundWorld world;
  for (const char* name : {kAerosonde, kZagi}) {
    const FixedWing vehicle = shipped_wing(name);
    const double speed = vehicle.mass_kg > 5.0 ? 26.0 : 13.0;
    const CoordinatedFlight flight(world.frame, vehicle);
    const Vector3d place = Vector3d(12000.0, -9000.0, 400.0);
    const Eigen::Matrix3d enu = world.frame.world_from_enu(place);
    for (const double radius_m : {1e9, 300.0, -90.0})
      for (const double climb : {0.0, 0.05}) {
        const Vector3d velocity = enu * (speed * Vector3d(std::cos(climb), 0.0, std::sin(climb)));
        const double level = speed * std::cos(climb);
        const Vector3d acceleration = enu * Vector3d(0.3, level * level / radius_m, 0.0);
        const auto pose =
            flight.pose(place, velocity, acceleration, Vector3d::Zero(), Vector3d::Zero());
        ASSERT_TRUE(pose);
        const Vector3d force = acceleration +
                               2.0 * earth_rate_world_radps(world.frame).cross(velocity) -
                               gravity_world_mps2(world.frame, place);
        const Vector3d upward =
            (force - force.dot(velocity) / (speed * speed) * velocity).normalized();
        const Airflow flow{.through_air_body_mps = pose->world_from_body.conjugate() * velocity,
                           .turn_rate_body_radps = {0.0, -acceleration.dot(upward) / speed, 0.0},
                           .density_kg_per_m3 = density_at_kg_per_m3(world.frame, place)};
        EXPECT_NEAR(flow.beta_rad(), 0.0, 1e-12);
        EXPECT_NEAR(flow.alpha_rad(), pose->alpha_rad, 1e-12);
        const WingForces forces = wing_forces(
            vehicle, flow, {.elevator_rad = pose->elevator_rad, .throttle = pose->throttle});
        EXPECT_LT((pose->world_from_body * forces.force_body_n - vehicle.mass_kg * force).norm(),
                  1e-9 * vehicle.mass_kg * 9.8)
            << name << radius_m;
        EXPECT_NEAR(forces.moment_body_nm.y(), 0.0, 1e-10);
        if (climb == 0.0) {
          const Vector3d local = enu.transpose() * force;
          EXPECT_NEAR(std::tan(pose->bank_rad), -local.y() / local.z(), 1e-9);
          const double load = std::hypot(local.y(), local.z()) / local.z();
          EXPECT_NEAR(load, 1.0 / std::cos(pose->bank_rad), 1e-9);
        }
      }
  }
}

// --- Flat flights -------------------------------------------------------------------------------

TEST(FlatWing, FliesThePathOfTheSameWaypointsExactly) {
  const GroundWorld world;
  const auto motion = trajectory_from(wing_text(kAerosonde, "speed_mps = 25.0\n"), world);
  std::string text = wing_text(kAerosonde, "speed_mps = 25.0\ncontinuity = \"fourth\"\n");
  text.replace(text.find("fixed_wing"), 10, "waypoints");
  text.erase(text.find("vehicle = "), text.find("speed_mps") - text.find("vehicle = "));
  const auto path = trajectory_from(text, world);
  // Speeds are given at two places and at four, whose sums are rounded differently.
  ASSERT_NEAR(motion->duration_s(), path->duration_s(), 1e-10);
  for (int i = 0; i <= 50; ++i) {
    const double time_s = motion->duration_s() * i / 50;
    EXPECT_LT((motion->at(time_s).world_from_body.translation -
               path->at(time_s).world_from_body.translation)
                  .norm(),
              1e-8);
    EXPECT_LT((motion->at(time_s).jerk_world_mps3 - path->at(time_s).jerk_world_mps3).norm(), 1e-8);
  }
}

TEST(FlatWing, AttitudesBetweenNodesAreThoseOfCoordinatedFlight) {
  const GroundWorld world;
  const auto motion = trajectory_from(wing_text(kAerosonde, "speed_mps = 25.0\n",
                                                "[wind]\nspeed_mps = 2.0\nfrom_deg = 200.0\n", 0.6),
                                      world);
  const auto& flat = dynamic_cast<const FlatWingFlight&>(*motion);
  double most_rad = 0.0, most_bank_rad = 0.0, most_mps2 = 0.0;
  for (int i = 0; i <= 3000; ++i) {
    const double time_s = motion->duration_s() * i / 3000;
    const auto pose = flat.pose_at(time_s);
    ASSERT_TRUE(pose);
    const MotionState state = motion->at(time_s);
    most_rad = std::max(most_rad, rotation_vector_of(pose->world_from_body.conjugate() *
                                                     state.world_from_body.rotation)
                                      .norm());
    most_bank_rad = std::max(most_bank_rad, std::abs(pose->bank_rad));
    // What an accelerometer reads to the left.
    const Vector3d force =
        state.acceleration_world_mps2 +
        2.0 * earth_rate_world_radps(world.frame).cross(state.velocity_world_mps) -
        gravity_world_mps2(world.frame, state.world_from_body.translation);
    most_mps2 = std::max(most_mps2,
                         std::abs(force.dot(state.world_from_body.rotation * Vector3d::UnitY())));
  }
  RecordProperty("most_rad", fmt::format("{:.2g}", most_rad));
  RecordProperty("most_bank_rad", fmt::format("{:.2g}", most_bank_rad));
  EXPECT_GT(most_bank_rad, 0.3);
  EXPECT_LT(most_rad, 1e-8);
  EXPECT_LT(most_mps2, 1e-7);
}

// Eastward over the ground in a wind from the north: the nose points north of east by asin(w / V).
TEST(FlatWing, PointsItsNoseIntoAWind) {
  const GroundWorld world;
  const double wind_mps = 6.0, speed_mps = 24.0;
  const auto motion = trajectory_from(
      straight_text(kAerosonde, "speed_mps = 24.0\n",
                    "[wind]\nspeed_mps = 6.0\nfrom_deg = 0.0\nprofile = \"even\"\n"),
      world);
  const MotionState state = motion->at(0.5 * motion->duration_s());
  const Vector3d nose = state.world_from_body.rotation * Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(nose.y(), nose.x()), std::atan(wind_mps / speed_mps), 1e-4);
  EXPECT_NEAR((state.velocity_world_mps - motion->wind_world_mps(1.0)).norm(),
              std::hypot(wind_mps, speed_mps), 1e-4);
  EXPECT_LT((motion->wind_world_mps(1.0) - Vector3d(0.0, -wind_mps, 0.0)).norm(), 1e-3);
}

TEST(FlatWing, ClosedPathsGoRound) {
  const GroundWorld world;
  const std::string text = fmt::format(R"(kind = "fixed_wing"
vehicle = "{}/configs/vehicles/{}"
closed = true
laps = 2.0
waypoints = [
  {{ east_m = 300.0, north_m = 0.0, height_m = 150.0 }},
  {{ east_m = 0.0, north_m = 300.0, height_m = 160.0 }},
  {{ east_m = -300.0, north_m = 0.0, height_m = 150.0 }},
  {{ east_m = 0.0, north_m = -300.0, height_m = 140.0 }},
]
)",
                                       TERRACAST_SOURCE_DIR, kAerosonde);
  const auto motion = trajectory_from(text, world);
  const double lap_s = 0.5 * motion->duration_s();
  for (const double time_s : {-0.3, 0.0, 1.234, 0.4 * lap_s}) {
    const MotionState once = motion->at(time_s), again = motion->at(time_s + lap_s);
    EXPECT_LT(rotation_vector_of(once.world_from_body.rotation.conjugate() *
                                 again.world_from_body.rotation)
                  .norm(),
              1e-9);
    EXPECT_LT((once.angular_velocity_body_radps - again.angular_velocity_body_radps).norm(), 1e-8);
  }
}

TEST(FlatWing, SaysWhatTheAircraftCannotFly) {
  const GroundWorld world;
  const auto refuse = [&](ErrorKind kind, const std::string& toml,
                          const std::vector<std::string>& words) {
    const std::string message = message_of(kind, [&] { trajectory_from(toml, world); });
    for (const std::string& word : words)
      EXPECT_NE(message.find(word), std::string::npos) << word << ": " << message;
  };
  // 13.5 kg on 0.55 m^2 at 8 m/s over 1150 m: a lift coefficient of 7.
  refuse(ErrorKind::Input, straight_text(kAerosonde, "speed_mps = 8.0\n"),
         {"the wing stalls at t = ", "lat 42.", "8.0 m/s through the air", "fly faster than"});
  refuse(ErrorKind::Input,
         straight_text(kAerosonde, "speed_mps = 20.0\n",
                       "[wind]\nspeed_mps = 12.0\nfrom_deg = 270.0\nprofile = \"even\"\n"),
         {"the wing stalls", "8.0 m/s through the air"});
  refuse(ErrorKind::Input, wing_text(kAerosonde, "speed_mps = 25.0\nmax_bank_deg = 10.0\n"),
         {"the aircraft banks by ", "max_bank_deg = 10", "wider"});
  refuse(ErrorKind::Input,
         wing_text(kAerosonde, "speed_mps = 25.0\nmax_roll_rate_deg_per_s = 3.0\n"),
         {"the aircraft rolls by ", "max_roll_rate_deg_per_s = 3"});
  refuse(ErrorKind::Input, straight_text(kZagi, "speed_mps = 19.5\n"),
         {"needs a thrust of", "its propeller gives", "climb less steeply, or fly slower"});
  refuse(ErrorKind::Input,
         straight_text(kZagi, "speed_mps = 13.0\nmax_climb_deg = 45.0\n", "", 350.0),
         {"needs a thrust of"});
  refuse(
      ErrorKind::Input,
      straight_text(kZagi, "speed_mps = 12.0\nmax_climb_deg = 45.0\nmin_agl_m = 0.0\n", "", -149.0),
      {"has to brake by", "descend less steeply"});
  refuse(ErrorKind::Config,
         straight_text(kAerosonde, "", "[wind]\nspeed_mps = 3.0\nturbulence = \"dryden\"\n"),
         {"turbulence of [wind] counts with mode = \"flown\" alone"});
  refuse(ErrorKind::Config, straight_text(kAerosonde, "", "[control]\nwind_s = 9.0\n"),
         {"[control] counts with mode = \"flown\" alone"});
  refuse(ErrorKind::Config,
         "kind = \"fixed_wing\"\nwaypoints = [{ east_m = 0.0, north_m = 0.0, height_m = 90.0 },\n"
         "  { east_m = 900.0, north_m = 0.0, height_m = 90.0 }]\n",
         {"an aircraft needs mass_kg", "configs/vehicles/aerosonde_beard_mclain.toml"});
  refuse(ErrorKind::Config,
         wing_text(kAerosonde, "speed_mps = 25.0\nclosed = true\nlaps = 1000.0\n"),
         {"the flight takes ", "at most 36000 s", "fly fewer laps"});
  // Faster than the message says is flown.
  EXPECT_NO_THROW(trajectory_from(straight_text(kAerosonde, "speed_mps = 16.0\n"), world));
}

// --- Flown flights ------------------------------------------------------------------------------

/// A flight along the S.
struct Flown {
  GroundWorld world;
  FixedWing vehicle = shipped_wing(kAerosonde);
  CoordinatedFlight flight{world.frame, vehicle};
  std::unique_ptr<Trajectory> plan =
      trajectory_from(wing_text(kAerosonde, "speed_mps = 25.0\n"), world);
};

FlightAir windy_air(const WindOptions& options) {
  return {.wind = WindField(options, 3e3, 100.0), .ground_height_m = [](double) { return 1000.0; }};
}

TEST(FlownWing, WithoutWindItKeepsToItsPath) {
  const Flown f;
  FlightReport report;
  const auto motion = fly(f.flight, *f.plan, {}, nullptr, 5.0, report);
  double most_rad = 0.0;
  for (int i = 0; i <= 200; ++i) {
    const MotionState planned = f.plan->at(motion->duration_s() * i / 200);
    most_rad =
        std::max(most_rad, rotation_vector_of(planned.world_from_body.rotation.conjugate() *
                                              motion->at(planned.time_s).world_from_body.rotation)
                               .norm());
  }
  RecordProperty("most_off_m", fmt::format("{:.3g}", report.most_off_m));
  RecordProperty("most_rad", fmt::format("{:.3g}", most_rad));
  EXPECT_LT(report.most_off_m, 0.5);
  EXPECT_LT(most_rad, 0.05);
  EXPECT_EQ(report.saturated_s, 0.0);
}

TEST(FlownWing, StepsAreOfTheFourthOrder) {
  const Flown f;
  const auto end_of = [&](int steps) {
    FixedWingDynamics dynamics(f.flight, {}, *f.plan, nullptr);
    WingState state = dynamics.start(0.0);
    state[rigid_state::kVelocity + 1] += 0.5;
    const double step_s = 2.0 / steps;
    for (int i = 0; i < steps; ++i)
      state = runge_kutta_step(state, i * step_s, step_s,
                               [&](double t, const WingState& s) { return dynamics.rates(t, s); });
    return state;
  };
  const WingState fine = end_of(800);
  const double coarse = (end_of(16) - fine).head<6>().norm();
  const double halved = (end_of(32) - fine).head<6>().norm();
  RecordProperty("halved_again", fmt::format("{:.3g}", (end_of(64) - fine).head<6>().norm()));
  RecordProperty("coarse", fmt::format("{:.3g}", coarse));
  RecordProperty("ratio", fmt::format("{:.3g}", coarse / halved));
  EXPECT_GT(coarse / halved, 11.0);
  EXPECT_LT(coarse / halved, 23.0);
}

// d(m V^2 / 2)/dt = (F + m g).V, Coriolis' force doing no work: by the states of a run in turbulence.
TEST(FlownWing, ItsEnergyIsTheWorkOfItsForces) {
  const Flown f;
  const FlightAir air = windy_air({.speed_mps = 5.0, .from_deg = 40.0, .turbulence = "dryden"});
  FixedWingDynamics dynamics(f.flight, {}, *f.plan, &air);
  WingState state = dynamics.start(0.0);
  const auto energy_of = [&](const WingState& s) {
    return 0.5 * f.vehicle.mass_kg * s.segment<3>(rigid_state::kVelocity).squaredNorm();
  };
  double work_j = 0.0, most_w = 0.0;
  const double begin_j = energy_of(state);
  const auto power_of = [&](double t, const WingState& s) {
    const Vector3d velocity = s.segment<3>(rigid_state::kVelocity);
    const Vector3d force =
        rotation_in(s) * dynamics.forces(t, s).force_body_n +
        f.vehicle.mass_kg * gravity_world_mps2(f.world.frame, dynamics.place_world(s));
    return force.dot(velocity);
  };
  constexpr int kSteps = 3000;
  for (int i = 0; i <= kSteps; ++i) {
    const double power = power_of(i * 1e-3, state);
    work_j += (i == 0 || i == kSteps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) * power * 1e-3 / 3.0;
    most_w = std::max(most_w, std::abs(power));
    if (i < kSteps)
      state = runge_kutta_step(state, i * 1e-3, 1e-3,
                               [&](double t, const WingState& s) { return dynamics.rates(t, s); });
  }
  EXPECT_GT(most_w, 20.0);
  EXPECT_NEAR(energy_of(state) - begin_j, work_j, 1e-7 * begin_j);
}

TEST(FlownWing, TheCurveAndItsWindPassWhereTheStepsDo) {
  const Flown f;
  const auto air = std::make_shared<FlightAir>(
      windy_air({.speed_mps = 6.0, .from_deg = 20.0, .turbulence = "dryden"}));
  FlightReport report;
  const auto motion = fly(f.flight, *f.plan, {}, air.get(), 20.0, report);
  motion->set_air(f.world.frame, air);
  FixedWingDynamics dynamics(f.flight, {}, *f.plan, air.get());
  WingState state = dynamics.start(0.0);
  double most_m = 0.0, most_rad = 0.0, most_mps2 = 0.0, most_wind_mps = 0.0, gusty_mps = 0.0;
  for (int i = 0; i < 6000; ++i) {
    const double time_s = i * 1e-3;
    if (i % 7 == 0) {
      const MotionState at = motion->at(time_s);
      most_m =
          std::max(most_m, (at.world_from_body.translation - dynamics.place_world(state)).norm());
      most_rad = std::max(
          most_rad,
          rotation_vector_of(rotation_in(state).conjugate() * at.world_from_body.rotation).norm());
      most_mps2 = std::max(
          most_mps2, (at.acceleration_world_mps2 -
                      Vector3d(dynamics.rates(time_s, state).segment<3>(rigid_state::kVelocity)))
                         .norm());
      const Vector3d wind = met_air(air.get(), f.world.frame, time_s, dynamics.place_world(state),
                                    state.segment<3>(rigid_state::kVelocity),
                                    state.segment<3>(FixedWingDynamics::kAirWay))
                                .wind_world_mps;
      most_wind_mps = std::max(most_wind_mps, (wind - motion->wind_world_mps(time_s)).norm());
      gusty_mps =
          std::max(gusty_mps, (wind - air->wind.mean_mps(air->place_in_air(
                                          f.world.frame, time_s, dynamics.place_world(state))))
                                  .norm());
    }
    state = runge_kutta_step(state, time_s, 1e-3,
                             [&](double t, const WingState& s) { return dynamics.rates(t, s); });
  }
  RecordProperty("most_m", fmt::format("{:.2g}", most_m));
  RecordProperty("most_rad", fmt::format("{:.2g}", most_rad));
  RecordProperty("most_mps2", fmt::format("{:.2g}", most_mps2));
  RecordProperty("most_wind_mps", fmt::format("{:.2g}", most_wind_mps));
  RecordProperty("off_m", fmt::format("{:.2g}", report.most_off_m));
  EXPECT_GT(gusty_mps, 0.5);
  EXPECT_LT(most_m, 1e-6);
  EXPECT_LT(most_rad, 5e-6);
  EXPECT_LT(most_mps2, 0.01);
  EXPECT_LT(most_wind_mps, 1e-5);
}

TEST(FlownWing, CrabsAgainstASteadyWindAndKeepsItsAirspeed) {
  const GroundWorld world;
  const auto motion = trajectory_from(
      straight_text(kAerosonde, "speed_mps = 24.0\nmode = \"flown\"\nmax_off_m = 1.0\n",
                    "[wind]\nspeed_mps = 6.0\nfrom_deg = 0.0\nprofile = \"even\"\n"),
      world);
  const MotionState state = motion->at(20.0);
  const Vector3d nose = state.world_from_body.rotation * Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(nose.y(), nose.x()), std::atan(6.0 / 24.0), 5e-3);
  EXPECT_NEAR((state.velocity_world_mps - motion->wind_world_mps(20.0)).norm(),
              std::hypot(6.0, 24.0), 0.05);
}

TEST(FlownWing, ComesBackAfterAGust) {
  const GroundWorld world;
  const auto motion = trajectory_from(
      straight_text(
          kAerosonde, "speed_mps = 25.0\nmode = \"flown\"\n",
          "[wind]\ngusts = [{ start_m = 50.0, length_m = 40.0, left_mps = 4.0, up_mps = 2.0 }]\n"),
      world);
  const auto plan = trajectory_from(straight_text(kAerosonde, "speed_mps = 25.0\n"), world);
  const auto off_m = [&](double time_s) {
    return (motion->at(time_s).world_from_body.translation -
            plan->at(time_s).world_from_body.translation)
        .norm();
  };
  double most_m = 0.0;
  for (double t = 0.0; t < 20.0; t += 0.1) most_m = std::max(most_m, off_m(t));
  EXPECT_GT(most_m, 0.3);
  EXPECT_LT(off_m(motion->duration_s()), 0.1 * most_m);
  // Gusts stay: 4 m/s from the side.
  EXPECT_NEAR(motion->wind_world_mps(20.0).norm(), std::hypot(4.0, 2.0), 1e-9);
}

TEST(FlownWing, TheSameWindIsMetAtAnyFrameRate) {
  const GroundWorld world;
  const TrajectoryOptions options = test::options_from(wing_text(
      kAerosonde, "speed_mps = 25.0\nmode = \"flown\"\nmax_off_m = 20.0\n",
      "[wind]\nspeed_mps = 3.0\nfrom_deg = 20.0\nturbulence = \"von_karman\"\nseed = 4\n"));
  TrajectoryContext context = world.context();
  const auto motion = options.kind_options().build(context);
  context.rate_hz = 123.0;
  context.reach_s = 0.02;
  const auto again = options.kind_options().build(context);
  for (const double time_s : {-0.4, 0.0, 1.234, motion->duration_s() + 0.3}) {
    EXPECT_EQ(motion->at(time_s).world_from_body, again->at(time_s).world_from_body);
    EXPECT_EQ(motion->at(time_s).jerk_world_mps3, again->at(time_s).jerk_world_mps3);
    EXPECT_EQ(motion->wind_world_mps(time_s), again->wind_world_mps(time_s));
  }
}

TEST(FlownWing, AWingWithoutARudderFliesWideTurns) {
  const GroundWorld world;
  FixedWing wing = shipped_wing(kZagi);
  // Its own is less than what its ailerons do to its nose while they hold the bank.
  wing.yaw.beta_per_rad = 0.03;
  const auto plan = trajectory_from(wing_text(kZagi, "speed_mps = 13.0\n"), world);
  FlightReport report;
  const auto motion = fly(CoordinatedFlight(world.frame, wing), *plan, {}, nullptr, 20.0, report);
  RecordProperty("rudderless_off_m", fmt::format("{:.3g}", report.most_off_m));
  EXPECT_LT(report.most_off_m, 5.0);
  const std::string refused = message_of(ErrorKind::Config, [&] {
    trajectory_from(wing_text(kZagi, "speed_mps = 13.0\nmode = \"flown\"\n"), world);
  });
  for (const char* word : {"no rudder", "lateral control departure", "mode = \"flat\""})
    EXPECT_NE(refused.find(word), std::string::npos) << refused;
}

TEST(FlownWing, SaysWhereItIsBlownOffItsPath) {
  const GroundWorld world;
  const std::string blown = message_of(ErrorKind::Input, [&] {
    trajectory_from(
        straight_text(kAerosonde, "speed_mps = 25.0\nmode = \"flown\"\nmax_off_m = 0.5\n",
                      "[wind]\ngusts = [{ start_m = 50.0, length_m = 5.0, left_mps = 12.0 }]\n"),
        world);
  });
  for (const char* word : {"the aircraft comes ", "off its path at t = ", "lat 42.",
                           "max_off_m = 0.5", "its controls", "or allow more"})
    EXPECT_NE(blown.find(word), std::string::npos) << blown;
}

}  // namespace
}  // namespace terracast::geo
