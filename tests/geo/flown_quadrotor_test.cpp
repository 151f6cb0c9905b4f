#include "geo/vehicles/flown_quadrotor.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/toml_reader.h"
#include "geo/gravity.h"
#include "geo/paths/attitude.h"
#include "tests/geo/free_tumbling.h"
#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
using test::FreeTumbling;
using test::GroundWorld;
using test::message_of;
using test::trajectory_from;
using State = QuadrotorDynamics::State;

Quadrotor shipped_vehicle(const std::string& name) {
  Quadrotor vehicle;
  core::TomlDocument::load(TERRACAST_SOURCE_DIR "/configs/vehicles/" + name).read(vehicle);
  return vehicle;
}

/// Stays at a place of the world, upright by gravity, its nose to the east.
class Hover final : public Trajectory {
 public:
  Hover(const WorldFrame& frame, const Vector3d& place, double duration_s)
      : duration_s_(duration_s) {
    const Vector3d zero = Vector3d::Zero();
    const LeastSnapCurve::Value motion{place, zero, zero, zero, zero};
    state_.world_from_body = {
        .rotation =
            flat_turning(frame, motion, {Vector3d::UnitX(), zero, zero}, 0.0).world_from_body,
        .translation = place};
  }
  double duration_s() const override { return duration_s_; }
  MotionState at(double time_s) const override {
    MotionState state = state_;
    state.time_s = time_s;
    return state;
  }
  std::vector<double> knots_s() const override { return {0.0, duration_s_}; }

 private:
  MotionState state_;
  double duration_s_;
};

/// Air above ground 1000 m above the ellipsoid.
FlightAir even_air(const WindOptions& options) {
  return {.wind = WindField(options, 1e4, 10.0), .ground_height_m = [](double) { return 1000.0; }};
}

// --- A rigid body without moments ---------------------------------------------------------------

// The brick of NASA TM-2015-218675, case 2, for 30 s in steps of 1 ms; on a turning Earth the world turns below it.
TEST(RigidBody, TumblesAsJacobisEllipticFunctionsSay) {
  const Vector3d inertia = 1.3558179483 * Vector3d(0.001894220, 0.006211019, 0.007194665);
  const Vector3d turn_rate = std::numbers::pi / 180.0 * Vector3d(10.0, 20.0, 30.0);
  const FreeTumbling truth(inertia, turn_rate);
  EXPECT_LT((truth.turn_rate(0.0) - turn_rate).norm(), 1e-14);
  using Body = Eigen::Matrix<double, rigid_state::kSize, 1>;
  for (const Vector3d& earth : {Vector3d(0.0, 0.0, 0.0), Vector3d(0.0, 5.4e-5, 4.9e-5)}) {
    Body body = Body::Zero();
    const Eigen::Quaterniond begin = truth.attitude(0.0);
    set_rotation(body, begin);
    body.segment<3>(rigid_state::kTurnRate) = turn_rate;
    const auto rates = [&](double, const Body& at) {
      Body change = Body::Zero();
      set_rigid_rates(at, Vector3d::Zero(), Vector3d::Zero(), inertia, earth, change);
      return change;
    };
    constexpr int kSteps = 30000;
    for (int i = 0; i < kSteps; ++i) body = runge_kutta_step(body, i * 1e-3, 1e-3, rates);
    const double earth_rad = earth.norm() * 30.0;
    const Eigen::Quaterniond world_from_stars(
        Eigen::AngleAxisd(-earth_rad, earth_rad > 0.0 ? earth.normalized() : Vector3d::UnitZ()));
    const Eigen::Quaterniond expected = world_from_stars * truth.attitude(30.0);
    EXPECT_LT(rotation_vector_of(expected.conjugate() * rotation_in(body)).norm(), 1e-10);
    EXPECT_LT((body.segment<3>(rigid_state::kTurnRate) - truth.turn_rate(30.0)).norm(), 1e-11);
  }
}

// --- Dynamics -----------------------------------------------------------------------------------

/// A Hummingbird whose rotors get faster and slower alike, off its place and leaning.
struct Disturbed {
  GroundWorld world;
  Quadrotor vehicle = shipped_vehicle("hummingbird_rotorpy.toml");
  Hover hover{world.frame, Vector3d(9000.0, 4000.0, 60.0), 10.0};
  std::unique_ptr<QuadrotorDynamics> dynamics;
  State state;

  Disturbed() {
    dynamics =
        std::make_unique<QuadrotorDynamics>(world.frame, vehicle, FlightControl{}, hover, nullptr);
    state = dynamics->start(0.0);
    state.segment<3>(rigid_state::kPosition) = Vector3d(0.1, -0.06, 0.1);
    state.segment<3>(rigid_state::kVelocity) = Vector3d(-0.2, 0.1, 0.4);
    set_rotation(state, rotation_in(state) * rotation_of(Vector3d(0.06, -0.04, 0.003)));
    EXPECT_FALSE(dynamics->commands(0.0, state).is_saturated);
  }
  State after(double time_s, double step_s) const {
    State at = state;
    const auto rates = [&](double t, const State& s) { return dynamics->rates(t, s); };
    const int count = static_cast<int>(std::lround(time_s / step_s));
    for (int i = 0; i < count; ++i) at = runge_kutta_step(at, i * step_s, step_s, rates);
    return at;
  }
};

TEST(FlownQuadrotor, ErrorsOfAStepFallWithItsFourthPower) {
  const Disturbed flight;
  const State truth = flight.after(0.32, 2.5e-4);
  const double coarse = (flight.after(0.32, 4e-3) - truth).head<rigid_state::kSize>().norm();
  const double fine = (flight.after(0.32, 2e-3) - truth).head<rigid_state::kSize>().norm();
  EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.4);
  EXPECT_LT(fine, 1e-5);
}

// What forces and moments do, integrated over the steps (Simpson), is what the kinetic energy grows by.
TEST(FlownQuadrotor, KineticEnergyGrowsByTheWorkOfItsForces) {
  const Disturbed flight;
  const Vector3d inertia = Eigen::Map<const Vector3d>(flight.vehicle.inertia_kg_m2.data());
  const auto energy = [&](const State& s) {
    return 0.5 * flight.vehicle.mass_kg * s.segment<3>(rigid_state::kVelocity).squaredNorm() +
           0.5 * inertia.dot(s.segment<3>(rigid_state::kTurnRate).cwiseAbs2());
  };
  const auto power = [&](double time_s, const State& s) {
    const auto [force, moment] = flight.dynamics->forces(time_s, s);
    const Vector3d weight = flight.vehicle.mass_kg *
                            gravity_world_mps2(flight.world.frame, flight.dynamics->place_world(s));
    return (force + weight).dot(s.segment<3>(rigid_state::kVelocity)) +
           moment.dot(s.segment<3>(rigid_state::kTurnRate));
  };
  const auto rates = [&](double t, const State& s) { return flight.dynamics->rates(t, s); };
  State state = flight.state;
  double work_j = 0.0, most_j = 0.0;
  constexpr double kStep_s = 2.5e-4;
  for (int i = 0; i < 2000; ++i) {
    const State middle = runge_kutta_step(state, 2 * i * kStep_s, kStep_s, rates);
    const State end = runge_kutta_step(middle, (2 * i + 1) * kStep_s, kStep_s, rates);
    work_j += kStep_s / 3.0 *
              (power(2 * i * kStep_s, state) + 4.0 * power((2 * i + 1) * kStep_s, middle) +
               power((2 * i + 2) * kStep_s, end));
    state = end;
    most_j = std::max(most_j, std::abs(energy(state) - energy(flight.state)));
  }
  EXPECT_GT(most_j, 0.05);
  EXPECT_NEAR(energy(state) - energy(flight.state), work_j, 2e-9);
}

TEST(FlownQuadrotor, HoversAtItsPlaceInStillAir) {
  const GroundWorld world;
  const Vector3d place(9000.0, 4000.0, 60.0);
  const Hover hover(world.frame, place, 3.0);
  FlightReport report;
  const auto motion =
      fly(world.frame, hover, shipped_vehicle("iris_rotors.toml"), {}, nullptr, 1.0, report);
  EXPECT_LT(report.most_off_m, 1e-9);
  EXPECT_EQ(report.saturated_s, 0.0);
  const MotionState state = motion->at(2.345);
  EXPECT_LT((state.world_from_body.translation - place).norm(), 1e-9);
  EXPECT_LT(state.angular_velocity_body_radps.norm(), 1e-9);
  EXPECT_LT(state.acceleration_world_mps2.norm(), 1e-9);
}

// In steady wind U thrust, weight and drag balance: along z, T = m g cos(tilt), and across, m g sin(tilt) = c U cos(tilt) with c
// the sum of k_d and the rotors' turn rates, which follow from T.
TEST(FlownQuadrotor, LeansAgainstASteadyWindByTheClosedForm) {
  const GroundWorld world;
  const Hover hover(world.frame, Vector3d(100.0, -50.0, 40.0), 2.0);
  const Quadrotor vehicle = shipped_vehicle("hummingbird_rotors.toml");
  const double wind_mps = 7.0;
  const FlightAir air = even_air({.speed_mps = wind_mps, .from_deg = 270.0, .profile = "even"});
  FlightReport report;
  const auto motion = fly(world.frame, hover, vehicle, {}, &air, 1.0, report);
  const MotionState state = motion->at(2.0);
  const Vector3d weight = gravity_world_mps2(world.frame, state.world_from_body.translation);
  double tilt_rad = 0.0;
  for (int i = 0; i < 100; ++i) {
    const double rotor_radps = std::sqrt(vehicle.mass_kg * weight.norm() * std::cos(tilt_rad) /
                                         (4.0 * vehicle.thrust_n_s2_per_rad2));
    tilt_rad = std::atan(4.0 * vehicle.drag_n_s2_per_rad_m * rotor_radps * wind_mps /
                         (vehicle.mass_kg * weight.norm()));
  }
  const Vector3d up = state.world_from_body.rotation * Vector3d::UnitZ();
  EXPECT_NEAR(std::acos(up.dot(-weight.normalized())), tilt_rad, 2e-5);
  EXPECT_GT(tilt_rad, 0.1);
  EXPECT_LT(up.x(), 0.0);  // against the wind from the west
  EXPECT_LT(report.most_off_m, 5e-3);
}

/// A vehicle without symmetry: no two rotors have the same arms, and lags differ.
Quadrotor lopsided_vehicle() {
  return {.mass_kg = 0.7,
          .num_rotors = 4,
          .thrust_n_s2_per_rad2 = 8e-6,
          .inertia_kg_m2 = {0.007, 0.008, 0.012},
          .moment_nm_s2_per_rad2 = 1.5e-7,
          .rotors = {{.x_m = 0.20, .y_m = 0.10, .spin = "left"},
                     {.x_m = 0.15, .y_m = -0.12, .spin = "right"},
                     {.x_m = -0.18, .y_m = -0.14, .spin = "left"},
                     {.x_m = -0.11, .y_m = 0.16, .spin = "right"}},
          .rotor_lag_up_s = 0.03,
          .rotor_lag_down_s = 0.07};
}

/// A place to hover at, with dynamics there.
struct Hovering {
  Hover hover;
  QuadrotorDynamics dynamics;
  State state;

  Hovering(const GroundWorld& world, const Quadrotor& vehicle)
      : hover(world.frame, Vector3d(100.0, -50.0, 40.0), 10.0),
        dynamics(world.frame, vehicle, {}, hover, nullptr),
        state(dynamics.start(0.0)) {}
};

// One rotor that turns pushes k_F W^2 up at its place r, which turns the body by r x F; its motor turns the body against its spin.
TEST(FlownQuadrotor, ARotorPushesAndTurnsTheBodyAboutEachAxis) {
  constexpr double kRotor_radps = 400.0;
  constexpr double kForce_n = 8e-6 * 160000.0, kMoment_nm = 1.5e-7 * 160000.0;
  const Vector3d arms_m[] = {
      {0.20, 0.10, 0.0}, {0.15, -0.12, 0.0}, {-0.18, -0.14, 0.0}, {-0.11, 0.16, 0.0}};
  const double to_the_right[] = {-1.0, 1.0, -1.0, 1.0};  // of the body, about z
  const GroundWorld world;
  Hovering flight(world, lopsided_vehicle());
  const Eigen::Quaterniond rotation = rotation_in(flight.state);
  for (Eigen::Index i = 0; i < 4; ++i) {
    flight.state.tail(4).setZero();
    flight.state[QuadrotorDynamics::kRotors + i] = kRotor_radps;
    const auto [force, moment] = flight.dynamics.forces(0.0, flight.state);
    const Vector3d push(0.0, 0.0, kForce_n);
    EXPECT_LT((rotation.conjugate() * force - push).norm(), 1e-12) << i;
    const Vector3d expected =
        arms_m[i].cross(push) + Vector3d(0.0, 0.0, to_the_right[i] * kMoment_nm);
    EXPECT_LT((moment - expected).norm(), 1e-12) << i << ": " << moment.transpose();
  }
  // That on the left in front rolls the body to the right and lifts its nose; it spins left and turns the body to the right.
  flight.state.tail(4).setZero();
  flight.state[QuadrotorDynamics::kRotors] = kRotor_radps;
  const Vector3d moment = flight.dynamics.forces(0.0, flight.state).second;
  EXPECT_GT(moment.x(), 0.0);
  EXPECT_LT(moment.y(), 0.0);
  EXPECT_LT(moment.z(), 0.0);
}

// At V through the air a rotor drags by -k_d W V across z at its place, and the body by -c |V| V.
TEST(FlownQuadrotor, RotorsAndBodyDragAgainstTheAir) {
  Quadrotor vehicle = lopsided_vehicle();
  vehicle.drag_n_s2_per_rad_m = 1e-4;
  vehicle.body_drag_n_s2_per_m2 = {0.01, 0.02, 0.03};
  const GroundWorld world;
  Hovering flight(world, vehicle);
  const Eigen::Quaterniond rotation = rotation_in(flight.state);
  flight.state.segment<3>(rigid_state::kVelocity) = rotation * Vector3d(2.0, -3.0, 6.0);  // 7 m/s
  flight.state.tail(4) << 0.0, 500.0, 0.0, 0.0;
  const auto [force, moment] = flight.dynamics.forces(0.0, flight.state);
  const Vector3d rotor_drag(-0.1, 0.15, 0.0), body_drag(-0.14, 0.42, -1.26), push(0.0, 0.0, 2.0);
  EXPECT_LT((rotation.conjugate() * force - (push + rotor_drag + body_drag)).norm(), 1e-12);
  const Vector3d expected =
      Vector3d(0.15, -0.12, 0.0).cross(push + rotor_drag) + Vector3d(0.0, 0.0, 0.0375);
  EXPECT_LT((moment - expected).norm(), 1e-12) << moment.transpose();
}

// The body is held, so that the commands stay.
TEST(FlownQuadrotor, RotorsFollowTheirCommandsWithTheLagOfTheirSense) {
  const GroundWorld world;
  Hovering flight(world, lopsided_vehicle());
  const Eigen::VectorXd told = flight.dynamics.commands(0.0, flight.state).rotors_radps;
  flight.state.tail(4) << 0.5 * told[0], 1.5 * told[1], 0.0, told[3];
  const State begin = flight.state;
  const auto rates = [&](double time_s, const State& at) {
    State change = State::Zero(at.size());
    change.tail(4) = flight.dynamics.rates(time_s, at).tail(4);
    return change;
  };
  State state = begin;
  constexpr int kSteps = 50;
  for (int i = 0; i < kSteps; ++i) state = runge_kutta_step(state, i * 1e-3, 1e-3, rates);
  const double up = 1.0 - std::exp(-0.05 / 0.03), down = 1.0 - std::exp(-0.05 / 0.07);
  EXPECT_NEAR(state.tail(4)[0], told[0] * (0.5 + 0.5 * up), 1e-5);
  EXPECT_NEAR(state.tail(4)[1], told[1] * (1.5 - 0.5 * down), 1e-5);
  EXPECT_NEAR(state.tail(4)[2], told[2] * up, 1e-5);
  EXPECT_NEAR(state.tail(4)[3], told[3], 1e-9);
}

// Across the body's z: m g sin(tilt) = c U (U cos(tilt)), whatever the drag along z.
TEST(FlownQuadrotor, LeansByTheDragOfItsBody) {
  const double wind_mps = 7.0;
  Quadrotor vehicle = lopsided_vehicle();
  vehicle.rotor_lag_up_s = vehicle.rotor_lag_down_s = 0.0;
  vehicle.body_drag_n_s2_per_m2 = {0.02, 0.02, 0.05};
  const GroundWorld world;
  const Hover hover(world.frame, Vector3d(100.0, -50.0, 40.0), 4.0);
  const FlightAir air = even_air({.speed_mps = wind_mps, .from_deg = 270.0, .profile = "even"});
  FlightReport report;
  const auto motion = fly(world.frame, hover, vehicle, {}, &air, 1.0, report);
  const MotionState state = motion->at(4.0);
  const Vector3d weight = gravity_world_mps2(world.frame, state.world_from_body.translation);
  const double tilt_rad = std::atan(0.02 * wind_mps * wind_mps / (0.7 * weight.norm()));
  const Vector3d up = state.world_from_body.rotation * Vector3d::UnitZ();
  EXPECT_NEAR(std::acos(up.dot(-weight.normalized())), tilt_rad, 2e-5);
  EXPECT_LT(up.x(), -0.1);
}

// Hovering, its way through the air is that of the mean wind: 5 m a second. Gains set only how long it settles before.
TEST(FlownQuadrotor, GustsCountTheirWayFromTimeZero) {
  const FlightAir air = even_air({.speed_mps = 5.0,
                                  .from_deg = 270.0,
                                  .profile = "even",
                                  .gusts = {{.start_m = 0.0, .length_m = 10.0, .left_mps = 2.0}}});
  const Quadrotor vehicle = shipped_vehicle("hummingbird_rotorpy.toml");
  const GroundWorld world;
  const Hover hover(world.frame, Vector3d(100.0, -50.0, 40.0), 1.0);
  for (const double position_radps : {2.0, 3.0}) {
    const FlightControl control{.position_radps = position_radps};
    QuadrotorDynamics dynamics(world.frame, vehicle, control, hover, &air);
    const int first = -static_cast<int>(1000.0 * settling_s(control.resolved(vehicle)));
    State state = dynamics.start(first * 1e-3);
    for (int i = first; i <= 1000; ++i) {
      const double time_s = i * 1e-3;
      if (i % 250 == 0) {
        const double share = std::max(time_s, 0.0) * 5.0 / 10.0;
        EXPECT_NEAR(dynamics.wind_world_mps(time_s, state).y(),
                    1.0 - std::cos(std::numbers::pi * share), time_s < 0.0 ? 1e-3 : 0.02)
            << time_s;
      }
      state = runge_kutta_step(state, time_s, 1e-3,
                               [&](double t, const State& at) { return dynamics.rates(t, at); });
    }
  }
}

// --- Flights ------------------------------------------------------------------------------------

/// A brisk figure with a set of configs/vehicles and further tables.
std::string flown_text(const std::string& vehicle, const std::string& keys,
                       const std::string& tables = "") {
  return "kind = \"quadrotor\"\nmode = \"flown\"\nvehicle = \"" TERRACAST_SOURCE_DIR
         "/configs/vehicles/" +
         vehicle + "\"\n" + keys + R"(
waypoints = [
  { east_m = 900.0, north_m = 400.0, height_m = 30.0 },
  { east_m = 909.0, north_m = 404.0, height_m = 33.0 },
  { east_m = 912.0, north_m = 413.0, height_m = 31.0 },
]
)" + tables;
}

/// The text with its vehicle's set as a table, with further keys of it at its end.
std::string with_vehicle_keys(std::string text, const std::string& keys) {
  const std::size_t line = text.find("vehicle = "), line_end = text.find('\n', line);
  const std::string path = text.substr(line + 11, line_end - line - 12);
  text.erase(line, line_end - line);
  return text + "[vehicle]\nextends = \"" + path + "\"\n" + keys;
}

constexpr const char* kTurbulent = R"(
[wind]
speed_mps = 5.0
from_deg = 200.0
turbulence = "dryden"
seed = 4
gusts = [{ start_m = 30.0, length_m = 10.0, left_mps = 2.0 }]
)";

/// How far a Hummingbird without lag comes off the path that is planned with its own drag.
struct Off {
  double most_m, most_rad;
  double most_lacking_rad;  ///< lean that the plan lacks, as rotors drag by their actual rates
};
Off off_without_lag(double drag_n_s2_per_rad_m) {
  const GroundWorld world;
  Quadrotor ideal = shipped_vehicle("hummingbird_rotors.toml");
  ideal.rotor_lag_up_s = ideal.rotor_lag_down_s = 0.0;
  ideal.drag_n_s2_per_rad_m = drag_n_s2_per_rad_m;
  std::string flat = flown_text("hummingbird_rotors.toml", "");
  flat.replace(flat.find("flown"), 5, "flat");
  const auto plan = trajectory_from(
      with_vehicle_keys(flat, fmt::format("drag_n_s2_per_rad_m = {}\n", drag_n_s2_per_rad_m)),
      world);
  FlightReport report;
  const auto motion = fly(world.frame, *plan, ideal, {}, nullptr, 1.0, report);
  Off off{.most_m = report.most_off_m, .most_rad = 0.0, .most_lacking_rad = 0.0};
  for (int i = 0; i <= 100; ++i) {
    const MotionState planned = plan->at(motion->duration_s() * i / 100);
    const MotionState flown = motion->at(planned.time_s);
    const Eigen::Quaterniond planned_from_flown =
        planned.world_from_body.rotation.conjugate() * flown.world_from_body.rotation;
    off.most_rad = std::max(off.most_rad, rotation_vector_of(planned_from_flown).norm());
    const Vector3d up = planned.world_from_body.rotation * Vector3d::UnitZ();
    const Vector3d& velocity = planned.velocity_world_mps;
    const double thrust_mps2 =
        (planned.acceleration_world_mps2 -
         gravity_world_mps2(world.frame, planned.world_from_body.translation))
            .dot(up);
    const double more = std::sqrt(thrust_mps2 / test::kGravity_mps2) - 1.0;
    off.most_lacking_rad =
        std::max(off.most_lacking_rad, std::abs(more) * ideal.drag_per_s() *
                                           (velocity - velocity.dot(up) * up).norm() / thrust_mps2);
  }
  return off;
}

// Without drag the controller knows all that acts. With it, it counts on rotors as fast as in hovering.
TEST(FlownQuadrotor, WithoutWindAndLagItKeepsToItsPath) {
  const Off exact = off_without_lag(0.0);
  const Off dragged =
      off_without_lag(shipped_vehicle("hummingbird_rotors.toml").drag_n_s2_per_rad_m);
  for (const auto& [name, off] : {std::pair{"exact", exact}, {"dragged", dragged}})
    RecordProperty(name, fmt::format("{:.2g} m, {:.2g} rad of {:.2g}", off.most_m, off.most_rad,
                                     off.most_lacking_rad));
  EXPECT_LT(exact.most_m, 1e-5);
  EXPECT_LT(exact.most_rad, 2e-5);
  EXPECT_LT(dragged.most_m, 0.01);
  EXPECT_LT(dragged.most_rad, 1.5 * dragged.most_lacking_rad);
  EXPECT_GT(dragged.most_rad, 0.3 * dragged.most_lacking_rad);
}

// The curve between its nodes against the steps that it was made from.
TEST(FlownQuadrotor, TheCurvePassesWhereTheStepsDo) {
  const GroundWorld world;
  std::string flat = flown_text("hummingbird_rotors.toml", "");
  flat.replace(flat.find("flown"), 5, "flat");
  const auto plan = trajectory_from(flat, world);
  const Quadrotor vehicle = shipped_vehicle("hummingbird_rotors.toml");
  WindOptions options{.speed_mps = 6.0, .from_deg = 20.0, .turbulence = "dryden"};
  const FlightAir air{.wind = WindField(options, 1e3, 20.0),
                      .ground_height_m = [](double) { return 1000.0; }};
  FlightReport report;
  const FlightControl control;
  const auto motion = fly(world.frame, *plan, vehicle, control, &air, 2.0, report);
  QuadrotorDynamics dynamics(world.frame, vehicle, control, *plan, &air);
  const int first = -20 * static_cast<int>(std::ceil(settling_s(control.resolved(vehicle)) / 0.02));
  State state = dynamics.start(first * 1e-3);
  double most_m = 0.0, most_rad = 0.0, most_mps2 = 0.0;
  for (int i = first; i < 3000; ++i) {
    if (i % 5 == 0 && i >= 0) {
      const MotionState at = motion->at(i * 1e-3);
      most_m =
          std::max(most_m, (at.world_from_body.translation - dynamics.place_world(state)).norm());
      most_rad = std::max(
          most_rad,
          rotation_vector_of(rotation_in(state).conjugate() * at.world_from_body.rotation).norm());
      const Vector3d acceleration =
          dynamics.rates(i * 1e-3, state).segment<3>(rigid_state::kVelocity);
      most_mps2 = std::max(most_mps2, (at.acceleration_world_mps2 - acceleration).norm());
    }
    state = runge_kutta_step(state, i * 1e-3, 1e-3,
                             [&](double t, const State& s) { return dynamics.rates(t, s); });
  }
  RecordProperty("most_m", fmt::format("{:.2g}", most_m));
  RecordProperty("most_rad", fmt::format("{:.2g}", most_rad));
  RecordProperty("most_mps2", fmt::format("{:.2g}", most_mps2));
  EXPECT_LT(most_m, 1e-6);
  EXPECT_LT(most_rad, 1e-6);
  EXPECT_LT(most_mps2, 1e-2);
}

TEST(FlownQuadrotor, TheSameWindIsMetAtAnyFrameRate) {
  const GroundWorld world;
  const TrajectoryOptions options =
      test::options_from(flown_text("hummingbird_rotors.toml", "", kTurbulent));
  TrajectoryContext context = world.context();
  const auto motion = options.kind_options().build(context);
  context.rate_hz = 123.0;
  context.reach_s = 0.02;
  const auto again = options.kind_options().build(context);
  for (const double time_s : {-0.4, 0.0, 1.234, motion->duration_s() + 0.3}) {
    EXPECT_EQ(motion->at(time_s).world_from_body, again->at(time_s).world_from_body);
    EXPECT_EQ(motion->at(time_s).jerk_world_mps3, again->at(time_s).jerk_world_mps3);
  }
  // Another seed is another wind.
  std::string text = flown_text("hummingbird_rotors.toml", "", kTurbulent);
  text.replace(text.find("seed = 4"), 8, "seed = 5");
  const auto other = trajectory_from(text, world);
  EXPECT_GT(
      (other->at(1.0).world_from_body.translation - motion->at(1.0).world_from_body.translation)
          .norm(),
      1e-4);
}

TEST(FlownQuadrotor, ShippedVehiclesHoverInWind) {
  const GroundWorld world;
  const Hover hover(world.frame, Vector3d(0.0, 0.0, 30.0), 0.5);
  for (const auto& entry :
       std::filesystem::directory_iterator(TERRACAST_SOURCE_DIR "/configs/vehicles")) {
    if (!test::is_set_of_rotors(entry.path())) continue;
    const Quadrotor vehicle = shipped_vehicle(entry.path().filename().string());
    const FlightAir air = even_air({.speed_mps = 2.0, .from_deg = 90.0, .profile = "even"});
    FlightReport report;
    const auto motion = fly(world.frame, hover, vehicle, {}, &air, 0.1, report);
    EXPECT_LT(report.most_off_m, 0.1) << entry.path();
  }
}

TEST(FlownQuadrotor, RefusesToSettleForHours) {
  const GroundWorld world;
  const auto message = [&](const std::string& keys, const std::string& control) {
    return message_of(ErrorKind::Config, [&] {
      trajectory_from(flown_text("hummingbird_rotors.toml", keys, "[control]\n" + control), world);
    });
  };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  for (const char* value : {"0.001", "1e-06", "1e-09", "1e-300"})
    has(message("", fmt::format("position_radps = {}\n", value)),
        fmt::format("[control] position_radps = {} is so slow", value));
  const std::string slow = message("", "attitude_radps = 1e-6\n");
  has(slow, "[control] attitude_radps = 1e-06 is so slow");
  has(slow, "set 0.037 or more, or leave it out, which sets 12");
  // That value lets it begin: it comes as far as being blown off its place.
  has(message_of(ErrorKind::Input,
                 [&] {
                   trajectory_from(
                       flown_text("hummingbird_rotors.toml", "max_off_m = 0.001\n",
                                  "[control]\nattitude_radps = 0.037\n[wind]\nspeed_mps = 5.0\n"),
                       world);
                 }),
      "max_off_m = 0.001 while it settles");
  has(message("closed = true\nlaps = 1000.0\n", ""), "10 s before it to settle");
}

TEST(FlownQuadrotor, SaysWhatIsWrongWithAFlight) {
  const GroundWorld world;
  const auto message = [&](ErrorKind kind, const std::string& toml) {
    return message_of(kind, [&] { trajectory_from(toml, world); });
  };
  const std::string set = "hummingbird_rotors.toml";
  // Rotors that give little more than hovering takes, in a gust.
  const std::string weak =
      flown_text(set, "max_off_m = 0.5\nmax_acceleration_mps2 = 0.5\n",
                 "[wind]\ngusts = [{ start_m = 4.0, length_m = 0.5, left_mps = 100.0 }]\n");
  const std::string blown =
      message(ErrorKind::Input, with_vehicle_keys(weak, "max_rotor_radps = 480.0\n"));
  EXPECT_NE(blown.find("off its path at t = "), std::string::npos) << blown;
  EXPECT_NE(blown.find("lat 42."), std::string::npos) << blown;
  EXPECT_NE(blown.find("its rotors were at their limits for"), std::string::npos) << blown;
  EXPECT_NE(message(ErrorKind::Input, flown_text(set, "max_off_m = 0.001\n", kTurbulent))
                .find("more than 10 times max_off_m = 0.001 while it settles"),
            std::string::npos);
  std::string flat = flown_text(set, "", kTurbulent);
  flat.replace(flat.find("flown"), 5, "flat");
  EXPECT_NE(message(ErrorKind::Config, flat).find("[wind] counts with mode = \"flown\" alone"),
            std::string::npos);
  std::string limited = flown_text(set, "max_off_m = 1.0\n");
  limited.replace(limited.find("flown"), 5, "flat");
  EXPECT_NE(
      message(ErrorKind::Config, limited).find("max_off_m counts with mode = \"flown\" alone"),
      std::string::npos);
  const auto own = [](const std::string& vehicle) {
    return "kind = \"quadrotor\"\nmode = \"flown\"\nwaypoints = [\n"
           "  { east_m = 0.0, north_m = 0.0, height_m = 30.0 },\n"
           "  { east_m = 9.0, north_m = 4.0, height_m = 33.0 },\n]\n[vehicle]\n" +
           vehicle;
  };
  EXPECT_NE(message(ErrorKind::Config, own("mass_kg = 1.0\n"))
                .find("mode = \"flown\" needs thrust_n_s2_per_rad2"),
            std::string::npos);
  EXPECT_NE(message(ErrorKind::Config, own("mass_kg = -1.0\n")).find("mass_kg"), std::string::npos);
  const std::string rotors = R"(
mass_kg = 0.7
thrust_n_s2_per_rad2 = 8.5e-6
moment_nm_s2_per_rad2 = 1.4e-7
rotors = [
  { x_m = 0.1, y_m = 0.1, spin = "left" },
  { x_m = 0.1, y_m = -0.1, spin = "left" },
  { x_m = -0.1, y_m = -0.1, spin = "left" },
  { x_m = -0.1, y_m = 0.1, spin = "left" },
]
)";
  EXPECT_NE(message(ErrorKind::Config, own(rotors + "inertia_kg_m2 = [0.01, 0.01, 0.02]\n"))
                .find("some must spin left and some right"),
            std::string::npos);
  EXPECT_NE(message(ErrorKind::Config, own(rotors + "inertia_kg_m2 = [7.0, 0.007, 0.012]\n"))
                .find("no body has a moment of inertia larger"),
            std::string::npos);
  EXPECT_NE(message(ErrorKind::Config,
                    own(rotors + "num_rotors = 6\ninertia_kg_m2 = [0.01, 0.01, 0.02]\n"))
                .find("4 rotors have places, and num_rotors = 6"),
            std::string::npos);
}

}  // namespace
}  // namespace terracast::geo
