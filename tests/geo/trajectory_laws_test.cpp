// What holds for every kind of trajectory.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <thread>
#include <tuple>

#include "core/schema_writer.h"
#include "tests/geo/trajectory_support.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

using test::GroundWorld;

/// A weaving climb, a fix a second.
void write_recording(const std::filesystem::path& file) {
  std::ofstream csv(file);
  csv << "time_s,x_m,y_m,z_m\n";
  for (int t = 0; t <= 30; ++t)
    csv << t << ',' << 18.0 * t << ',' << 60.0 * std::sin(t / 6.0) << ','
        << 25.0 * std::sin(t / 9.0) << '\n';
}

/// A lively example of each kind: turns, climbs, changes of speed.
std::string example_of(const std::string& kind, const std::filesystem::path& folder) {
  write_recording(folder / "flight.csv");
  const std::string recorded = fmt::format(R"(
kind = "recorded"
file = "{}"
format = "csv"
frame = "local"
place_columns = ["x_m", "y_m", "z_m"]
origin = {{ lat_deg = 42.51, lon_deg = 1.52, height_m = 120.0 }}
sigma_m = 0.02
)",
                                           (folder / "flight.csv").string());
  const std::map<std::string, std::string> examples = {{"corridor", R"(
kind = "corridor"
line = [
  { lat_deg = 42.500, lon_deg = 1.500 },
  { lat_deg = 42.502, lon_deg = 1.506 },
  { lat_deg = 42.506, lon_deg = 1.507 },
]
num_lines = 2
line_spacing_m = 40.0
)"},
                                                       {"explore", R"(
kind = "explore"
area = [
  { lat_deg = 42.50, lon_deg = 1.50 },
  { lat_deg = 42.50, lon_deg = 1.53 },
  { lat_deg = 42.52, lon_deg = 1.53 },
  { lat_deg = 42.52, lon_deg = 1.50 },
]
num_legs = 5
seed = 3
)"},
                                                       {"survey", R"(
kind = "survey"
area = [
  { lat_deg = 42.510, lon_deg = 1.520 },
  { lat_deg = 42.510, lon_deg = 1.522 },
  { lat_deg = 42.512, lon_deg = 1.523 },
]
heading_deg = 15.0
height_m = 100.0
overlap = 0.98
)"},
                                                       {"facade", R"(
kind = "facade"
wall = [{ lat_deg = 42.51, lon_deg = 1.52 }, { lat_deg = 42.5102, lon_deg = 1.5205 }]
highest_m = 25.0
)"},
                                                       {"fixed_wing", R"(
kind = "fixed_wing"
waypoints = [
  { lat_deg = 42.500, lon_deg = 1.500, height_m = 120.0 },
  { lat_deg = 42.502, lon_deg = 1.504, height_m = 140.0 },
  { lat_deg = 42.501, lon_deg = 1.508, height_m = 125.0 },
]
[vehicle]
mass_kg = 13.5
inertia_kg_m2 = [0.8244, 1.135, 1.759]
product_of_inertia_kg_m2 = 0.1204
wing_area_m2 = 0.55
span_m = 2.8956
chord_m = 0.18994
lift = { zero = 0.28, alpha_per_rad = 3.45, elevator_per_rad = -0.36 }
drag = { parasitic = 0.0437 }
pitch = { zero = -0.02338, alpha_per_rad = -0.38, q_per_rad = -3.6, elevator_per_rad = -0.5 }
side = { beta_per_rad = -0.98, rudder_per_rad = -0.17 }
roll = { beta_per_rad = -0.12, p_per_rad = -0.26, r_per_rad = 0.14, aileron_per_rad = 0.08, rudder_per_rad = 0.105 }
yaw = { beta_per_rad = 0.25, p_per_rad = 0.022, r_per_rad = -0.35, aileron_per_rad = 0.06, rudder_per_rad = -0.032 }
propeller = { area_m2 = 0.2027, full_mps = 80.0 }
[wind]
speed_mps = 4.0
from_deg = 30.0
)"},
                                                       {"fixed_wing_flown", R"(
kind = "fixed_wing"
mode = "flown"
waypoints = [
  { lat_deg = 42.500, lon_deg = 1.500, height_m = 120.0 },
  { lat_deg = 42.502, lon_deg = 1.504, height_m = 140.0 },
  { lat_deg = 42.501, lon_deg = 1.508, height_m = 125.0 },
]
[vehicle]
mass_kg = 13.5
inertia_kg_m2 = [0.8244, 1.135, 1.759]
product_of_inertia_kg_m2 = 0.1204
wing_area_m2 = 0.55
span_m = 2.8956
chord_m = 0.18994
lift = { zero = 0.28, alpha_per_rad = 3.45, elevator_per_rad = -0.36 }
drag = { parasitic = 0.0437 }
pitch = { zero = -0.02338, alpha_per_rad = -0.38, q_per_rad = -3.6, elevator_per_rad = -0.5 }
side = { beta_per_rad = -0.98, rudder_per_rad = -0.17 }
roll = { beta_per_rad = -0.12, p_per_rad = -0.26, r_per_rad = 0.14, aileron_per_rad = 0.08, rudder_per_rad = 0.105 }
yaw = { beta_per_rad = 0.25, p_per_rad = 0.022, r_per_rad = -0.35, aileron_per_rad = 0.06, rudder_per_rad = -0.032 }
propeller = { area_m2 = 0.2027, full_mps = 80.0 }
[wind]
speed_mps = 4.0
gusts = [{ start_m = 60.0, length_m = 120.0, left_mps = 1.0, up_mps = 0.5 }]
)"},
                                                       {"forward", R"(
kind = "forward"
start = { lat_deg = 42.51, lon_deg = 1.52, height_m = 80.0 }
heading_deg = 30.0
climb_m = 40.0
length_m = 400.0
)"},
                                                       {"loop", R"(
kind = "loop"
start = { east_m = 9000.0, north_m = -4000.0, height_m = 120.0 }
heading_deg = 250.0
length_m = 500.0
width_m = 260.0
height_change_m = 45.0
direction = "right"
)"},
                                                       {"orbit", R"(
kind = "orbit"
centre = { lat_deg = 42.45, lon_deg = 1.58, height_m = 1200.0, above = "ellipsoid" }
radius_m = 150.0
speed_mps = 18.0
)"},
                                                       {"quadrotor", R"(
kind = "quadrotor"
waypoints = [
  { lat_deg = 42.50, lon_deg = 1.50, height_m = 40.0 },
  { lat_deg = 42.5008, lon_deg = 1.5005, height_m = 60.0 },
  { lat_deg = 42.5010, lon_deg = 1.5020, height_m = 35.0 },
  { east_m = 250.0, north_m = -60.0, height_m = 1070.0, above = "ellipsoid" },
]
[vehicle]
mass_kg = 0.716
thrust_n_s2_per_rad2 = 8.54858e-6
drag_n_s2_per_rad_m = 8.06428e-5
max_rotor_radps = 838.0
)"},
                                                       {"quadrotor_flown", R"(
kind = "quadrotor"
mode = "flown"
waypoints = [
  { lat_deg = 42.50, lon_deg = 1.50, height_m = 40.0 },
  { lat_deg = 42.50005, lon_deg = 1.50004, height_m = 41.0 },
  { lat_deg = 42.50006, lon_deg = 1.50012, height_m = 39.0 },
]
[vehicle]
mass_kg = 0.5
thrust_n_s2_per_rad2 = 5.57e-6
drag_n_s2_per_rad_m = 1.19e-4
max_rotor_radps = 1500.0
inertia_kg_m2 = [3.65e-3, 3.68e-3, 7.03e-3]
moment_nm_s2_per_rad2 = 1.36e-7
rotor_lag_up_s = 0.02
rotor_lag_down_s = 0.03
rotors = [
  { x_m = 0.12, y_m = 0.12, spin = "right" },
  { x_m = 0.12, y_m = -0.12, spin = "left" },
  { x_m = -0.12, y_m = -0.12, spin = "right" },
  { x_m = -0.12, y_m = 0.12, spin = "left" },
]
[control]
attitude_radps = 16.0
position_radps = 5.0
[wind]
speed_mps = 4.0
turbulence = "dryden"
)"},
                                                       {"recorded", recorded},
                                                       {"waypoints", R"(
kind = "waypoints"
speed_mps = 20.0
waypoints = [
  { lat_deg = 42.50, lon_deg = 1.50, height_m = 100.0 },
  { lat_deg = 42.503, lon_deg = 1.502, height_m = 160.0, speed_mps = 30.0 },
  { lat_deg = 42.5035, lon_deg = 1.508, height_m = 130.0 },
  { east_m = 900.0, north_m = 200.0, height_m = 1300.0, above = "ellipsoid", speed_mps = 12.0 },
  { east_m = 1500.0, north_m = -100.0, height_m = 200.0 },
]
)"}};
  const auto found = examples.find(kind);
  if (found == examples.end()) {
    ADD_FAILURE() << "the kind " << kind << " has no example here";
    return "";
  }
  return found->second;
}

/// Vehicles' flights are of the fourth order always, and no key says it.
bool has_continuity_key(const std::string& kind) {
  return !kind.starts_with("quadrotor") && !kind.starts_with("fixed_wing");
}

/// The keys of a kind's example with one more, which stands before tables.
std::string with_continuity(const std::string& kind, const std::string& keys,
                            const std::string& continuity) {
  if (!has_continuity_key(kind)) return keys;
  return fmt::format("continuity = \"{}\"\n{}", continuity, keys);
}

/// Parameters: a kind, and `continuity`.
class TrajectoryLaws : public testing::TestWithParam<std::tuple<std::string, std::string>> {
 protected:
  bool is_of_fourth() const { return std::get<1>(GetParam()) == "fourth"; }

  terracast::test::ScratchFolder scratch_;
  GroundWorld world_;
  TrajectoryOptions options_ = test::options_from(
      with_continuity(std::get<0>(GetParam()), example_of(std::get<0>(GetParam()), scratch_.path()),
                      std::get<1>(GetParam())));
  std::unique_ptr<Trajectory> motion_ = options_.kind_options().build(world_.context());
};

Eigen::Vector3d rotation_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::AngleAxisd turn(a.conjugate() * b);
  return turn.angle() * turn.axis();
}

TEST_P(TrajectoryLaws, VelocitiesAreTheDerivativesOfThePose) {
  constexpr double kStep_s = 1e-3;
  const int count = 400;
  for (int i = 0; i < count; ++i) {
    const double time_s = kStep_s + (motion_->duration_s() - 2 * kStep_s) * (i + 0.37) / count;
    const MotionState before = motion_->at(time_s - kStep_s);
    const MotionState state = motion_->at(time_s);
    const MotionState after = motion_->at(time_s + kStep_s);
    const Eigen::Vector3d velocity =
        (after.world_from_body.translation - before.world_from_body.translation) / (2 * kStep_s);
    // Third derivatives of some 10 m/s^3 times step^2 / 6, and 1e-10 m of rounding over the step.
    ASSERT_LT((state.velocity_world_mps - velocity).norm(), 1e-5) << time_s;
    const Eigen::Vector3d acceleration =
        (after.velocity_world_mps - before.velocity_world_mps) / (2 * kStep_s);
    // Where pieces of a spline meet the third derivative jumps by some 10 m/s^3: a quarter of it
    // times the step.
    ASSERT_LT((state.acceleration_world_mps2 - acceleration).norm(), 5e-3) << time_s;
    // Half from each side, so that the body axes are those in the middle.
    const Eigen::Quaterniond& middle = state.world_from_body.rotation;
    const Eigen::Vector3d turning = (rotation_between(middle, after.world_from_body.rotation) -
                                     rotation_between(middle, before.world_from_body.rotation)) /
                                    (2 * kStep_s);
    // Where pieces of a spline meet the third derivative jumps, and with it the turn's own rate.
    ASSERT_LT((state.angular_velocity_body_radps - turning).norm(), 2e-5) << time_s;
    ASSERT_NEAR(state.world_from_body.rotation.norm(), 1.0, 1e-15);
    ASSERT_EQ(state.time_s, time_s);
  }
}

/// Random times that lie so far from all knots, beginning and end, in this order: a time and how far.
std::vector<std::pair<double, double>> times_between_knots(const Trajectory& motion, int count,
                                                           double least_room_s) {
  const std::vector<double> knots_s = motion.knots_s();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(0.0, motion.duration_s());
  std::vector<std::pair<double, double>> times;
  for (int tries = 0; static_cast<int>(times.size()) < count && tries < 400 * count; ++tries) {
    const double time_s = any(random);
    const auto after = std::upper_bound(knots_s.begin(), knots_s.end(), time_s);
    if (after == knots_s.begin() || after == knots_s.end()) continue;
    const double room_s = std::min(time_s - *(after - 1), *after - time_s);
    if (room_s >= least_room_s) times.emplace_back(time_s, room_s);
  }
  EXPECT_EQ(static_cast<int>(times.size()), count);
  return times;
}

/// Central difference of the eighth order.
template <class Value>
Eigen::Vector3d derivative(const Value& value_at, double time_s, double step_s) {
  constexpr double kWeights[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < 4; ++i)
    sum +=
        kWeights[i] * (value_at(time_s + (i + 1) * step_s) - value_at(time_s - (i + 1) * step_s));
  return sum / step_s;
}

/// What each derivative differs by from the difference of the one before it.
struct DerivativeErrors {
  double velocity, acceleration, jerk, angular_velocity, angular_acceleration;
};

DerivativeErrors derivative_errors(const Trajectory& motion, double time_s, double step_s) {
  const MotionState state = motion.at(time_s);
  const Eigen::Quaterniond& middle = state.world_from_body.rotation;
  const auto difference = [&](const auto& value_at) {
    return derivative(value_at, time_s, step_s);
  };
  // The rotation vector from the middle turns at the body's rate there: its derivative is the angular velocity.
  return {(difference([&](double t) { return motion.at(t).world_from_body.translation; }) -
           state.velocity_world_mps)
              .norm(),
          (difference([&](double t) { return motion.at(t).velocity_world_mps; }) -
           state.acceleration_world_mps2)
              .norm(),
          (difference([&](double t) { return motion.at(t).acceleration_world_mps2; }) -
           state.jerk_world_mps3)
              .norm(),
          (difference([&](double t) {
             return rotation_between(middle, motion.at(t).world_from_body.rotation);
           }) -
           state.angular_velocity_body_radps)
              .norm(),
          (difference([&](double t) { return motion.at(t).angular_velocity_body_radps; }) -
           state.angular_acceleration_body_radps2)
              .norm()};
}

TEST_P(TrajectoryLaws, AllDerivativesAreExactAtAnyTime) {
  constexpr double kLeastRoom_s = 0.004, kMostStep_s = 0.02;
  DerivativeErrors most{};
  DerivativeErrors size{};
  for (const auto& [time_s, room_s] : times_between_knots(*motion_, 300, kLeastRoom_s)) {
    const MotionState state = motion_->at(time_s);
    const DerivativeErrors here =
        derivative_errors(*motion_, time_s, std::min(room_s / 4.01, kMostStep_s));
    most = {std::max(most.velocity, here.velocity), std::max(most.acceleration, here.acceleration),
            std::max(most.jerk, here.jerk), std::max(most.angular_velocity, here.angular_velocity),
            std::max(most.angular_acceleration, here.angular_acceleration)};
    size = {std::max(size.velocity, state.velocity_world_mps.norm()),
            std::max(size.acceleration, state.acceleration_world_mps2.norm()),
            std::max(size.jerk, state.jerk_world_mps3.norm()),
            std::max(size.angular_velocity, state.angular_velocity_body_radps.norm()),
            std::max(size.angular_acceleration, state.angular_acceleration_body_radps2.norm())};
  }
  const auto record = [&](const char* what, double error, double of) {
    RecordProperty(what, fmt::format("{:.2g} of {:.3g}", error, of));
  };
  record("velocity", most.velocity, size.velocity);
  record("acceleration", most.acceleration, size.acceleration);
  record("jerk", most.jerk, size.jerk);
  record("angular_velocity", most.angular_velocity, size.angular_velocity);
  record("angular_acceleration", most.angular_acceleration, size.angular_acceleration);
  // Places are rounded to 2e-12 m, and known along the path to 1e-11 m; over steps of a millisecond.
  EXPECT_LT(most.velocity, 1e-9 * size.velocity);
  EXPECT_LT(most.acceleration, 1e-9 * size.acceleration);
  // A facade's controls are half a metre apart: their rounding makes errors of the acceleration as elsewhere, but over a
  // jerk that is small.
  EXPECT_LT(most.jerk, 1e-9 * size.jerk + (std::get<0>(GetParam()) == "facade" ? 2e-8 : 0.0));
  // A nose at a wall does not turn.
  EXPECT_LT(most.angular_velocity, 1e-9 * size.angular_velocity + 1e-12);
  // On an orbit there is none.
  EXPECT_LT(most.angular_acceleration, 1e-9 * size.angular_acceleration + 1e-12);
}

TEST_P(TrajectoryLaws, PosesVelocitiesAndAccelerationsAreContinuousAcrossKnots) {
  constexpr double kNear_s = 1e-7;
  for (const double knot_s : motion_->knots_s()) {
    const MotionState before = motion_->at(knot_s - kNear_s), after = motion_->at(knot_s + kNear_s);
    const auto expect_near = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                 const Eigen::Vector3d& rate_a, const Eigen::Vector3d& rate_b,
                                 double rounding) {
      ASSERT_LT((b - a).norm(), 2.1 * kNear_s * std::max(rate_a.norm(), rate_b.norm()) + rounding)
          << knot_s;
    };
    expect_near(before.world_from_body.translation, after.world_from_body.translation,
                before.velocity_world_mps, after.velocity_world_mps, 1e-9);
    expect_near(before.velocity_world_mps, after.velocity_world_mps, before.acceleration_world_mps2,
                after.acceleration_world_mps2, 1e-9);
    expect_near(before.acceleration_world_mps2, after.acceleration_world_mps2,
                before.jerk_world_mps3, after.jerk_world_mps3, 1e-8);
    expect_near(before.angular_velocity_body_radps, after.angular_velocity_body_radps,
                before.angular_acceleration_body_radps2, after.angular_acceleration_body_radps2,
                1e-10);
    ASSERT_LT(
        rotation_between(before.world_from_body.rotation, after.world_from_body.rotation).norm(),
        2.1 * kNear_s *
                std::max(before.angular_velocity_body_radps.norm(),
                         after.angular_velocity_body_radps.norm()) +
            1e-12);
  }
}

TEST_P(TrajectoryLaws, OfTheFourthOrderJerkAndAngularAccelerationAreContinuousToo) {
  if (!is_of_fourth()) GTEST_SKIP() << "they jump at knots";
  // As the step to a knot shrinks by ten, so does the difference; a jump would stay.
  double jerk_mps3 = 0.0, angular_radps2 = 0.0;
  const std::vector<double> knots_s = motion_->knots_s();
  for (const double knot_s : knots_s) {
    // Beyond its ends a motion keeps its acceleration.
    if (knot_s < 1e-3 || knot_s > motion_->duration_s() - 1e-3) continue;
    constexpr double kNear_s = 1e-6;
    const MotionState before = motion_->at(knot_s - kNear_s), after = motion_->at(knot_s + kNear_s);
    jerk_mps3 = std::max(jerk_mps3, (after.jerk_world_mps3 - before.jerk_world_mps3).norm());
    angular_radps2 = std::max(
        angular_radps2,
        (after.angular_acceleration_body_radps2 - before.angular_acceleration_body_radps2).norm());
  }
  // Snaps of some 100 m/s^4 over two microseconds.
  EXPECT_LT(jerk_mps3, 2e-3);
  EXPECT_LT(angular_radps2, 2e-3);
}

TEST_P(TrajectoryLaws, AShutterMayLookBeforeTheBeginningAndAfterTheEnd) {
  const double end_s = motion_->duration_s();
  // Half a second out the roll has settled, and has no knots any more. Closed paths go round.
  const std::string& kind = std::get<0>(GetParam());
  // What is flown has knots there.
  if (kind != "loop" && kind != "orbit" && kind != "quadrotor_flown" && kind != "fixed_wing_flown")
    for (const double time_s : {-0.5, end_s + 0.5}) {
      const DerivativeErrors errors = derivative_errors(*motion_, time_s, 0.005);
      EXPECT_LT(errors.velocity, 1e-7) << time_s;
      EXPECT_LT(errors.acceleration, 1e-7) << time_s;
      EXPECT_LT(errors.jerk, 1e-7) << time_s;
      EXPECT_LT(errors.angular_velocity, 1e-8) << time_s;
      EXPECT_LT(errors.angular_acceleration, 1e-8) << time_s;
    }
  constexpr double kNear_s = 1e-7;
  for (const double time_s : {0.0, end_s}) {
    const MotionState before = motion_->at(time_s - kNear_s), after = motion_->at(time_s + kNear_s);
    EXPECT_LT((after.world_from_body.translation - before.world_from_body.translation -
               2.0 * kNear_s * after.velocity_world_mps)
                  .norm(),
              1e-9);
    EXPECT_LT((after.acceleration_world_mps2 - before.acceleration_world_mps2).norm(), 1e-4);
    EXPECT_LT((after.angular_velocity_body_radps - before.angular_velocity_body_radps).norm(),
              1e-5);
  }
}

// 30 ms of readout, at random times: knots fall within it.
TEST_P(TrajectoryLaws, LinesOfAShutterAreWhereTheMotionIs) {
  constexpr double kReach_s = 0.015, kFocal_px = 320.0;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> any(0.0, motion_->duration_s());
  std::uniform_real_distribution<double> offset(-kReach_s, kReach_s);
  double most_m = 0.0, most_rad = 0.0, constants_rad = 0.0;
  for (int i = 0; i < 300; ++i) {
    const double time_s = i == 0 ? 0.0 : any(random);
    MotionState state = motion_->at(time_s);
    const MotionState constants = state;
    state.terms = fit_terms(
        state, [&](double t) { return motion_->at(time_s + t).world_from_body; }, kReach_s);
    for (int k = 0; k < 20; ++k) {
      const double t = offset(random);
      const Rigid3d stated = state.pose_after(t), truth = motion_->at(time_s + t).world_from_body;
      const double error_m = (stated.translation - truth.translation).norm();
      const double error_rad = rotation_between(stated.rotation, truth.rotation).norm();
      ASSERT_LE(error_m, state.terms.error_m + 1e-10) << time_s;
      ASSERT_LE(error_rad, state.terms.error_rad + 1e-13) << time_s;
      most_m = std::max(most_m, error_m);
      most_rad = std::max(most_rad, error_rad);
      constants_rad = std::max(
          constants_rad, rotation_between(constants.pose_after(t).rotation, truth.rotation).norm());
    }
  }
  RecordProperty("most_m", fmt::format("{:.2g}", most_m));
  RecordProperty("most_px", fmt::format("{:.2g}", kFocal_px * most_rad));
  RecordProperty("constants_px", fmt::format("{:.2g}", kFocal_px * constants_rad));
  EXPECT_LT(most_m, 1e-6);
  EXPECT_LT(kFocal_px * most_rad, 1e-3);
}

TEST_P(TrajectoryLaws, PositionsAreTwiceContinuouslyDifferentiable) {
  // A jump in acceleration would stay while the step shrinks; a bounded third derivative gives
  // differences that shrink with it.
  const auto largest_jump = [&](double step_s) {
    const auto velocity = [&](double t) { return motion_->at(t).velocity_world_mps; };
    double jump = 0.0;
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    const int count = static_cast<int>(motion_->duration_s() / step_s);
    for (int i = 0; i + 1 < count; ++i) {
      const Eigen::Vector3d acceleration =
          (velocity((i + 1) * step_s) - velocity(i * step_s)) / step_s;
      if (i > 0) jump = std::max(jump, (acceleration - before).norm());
      before = acceleration;
    }
    return jump;
  };
  const double coarse = largest_jump(0.05);
  const double fine = largest_jump(0.005);
  EXPECT_LT(fine, 0.15 * coarse + 1e-6);
}

TEST_P(TrajectoryLaws, TheBodyLooksAheadWithItsWingsLevelledByGravity) {
  if (!has_continuity_key(std::get<0>(GetParam())))
    GTEST_SKIP() << "it leans into its acceleration";
  if (std::get<0>(GetParam()) == "facade") GTEST_SKIP() << "it looks at its wall";
  for (int i = 0; i <= 100; ++i) {
    const MotionState state = motion_->at(motion_->duration_s() * i / 100);
    const Eigen::Matrix3d axes = state.world_from_body.rotation.toRotationMatrix();
    ASSERT_LT((axes.col(0) - state.velocity_world_mps.normalized()).norm(), 1e-12);
    const Eigen::Vector3d up = world_.frame.up_world(state.world_from_body.translation);
    ASSERT_GT(axes.col(2).dot(up), 0.5);
    ASSERT_LE(std::abs(test::roll_rad(world_, state)), 30.0 * std::numbers::pi / 180 + 1e-12);
  }
}

TEST_P(TrajectoryLaws, BuildingAgainAndManyThreadsGiveTheSameBits) {
  const auto again = options_.kind_options().clone()->build(world_.context());
  ASSERT_EQ(again->duration_s(), motion_->duration_s());
  std::vector<std::vector<MotionState>> results(3);
  {
    std::vector<std::jthread> threads;
    for (auto& result : results) {
      threads.emplace_back([&, this] {
        for (int i = 0; i < 200; ++i) result.push_back(again->at(again->duration_s() * i / 199));
      });
    }
  }
  for (int i = 0; i < 200; ++i) {
    const MotionState state = motion_->at(motion_->duration_s() * i / 199);
    for (const auto& result : results) {
      ASSERT_EQ(result[i].world_from_body, state.world_from_body);
      ASSERT_EQ(result[i].velocity_world_mps, state.velocity_world_mps);
      ASSERT_EQ(result[i].acceleration_world_mps2, state.acceleration_world_mps2);
      ASSERT_EQ(result[i].angular_velocity_body_radps, state.angular_velocity_body_radps);
      ASSERT_EQ(result[i].jerk_world_mps3, state.jerk_world_mps3);
      ASSERT_EQ(result[i].angular_acceleration_body_radps2, state.angular_acceleration_body_radps2);
    }
  }
}

TEST_P(TrajectoryLaws, OptionsReadBackFromTheirOwnText) {
  const std::string text = core::toml_text(options_);
  EXPECT_EQ(text.find("nan"), std::string::npos) << text;
  const TrajectoryOptions again = test::options_from(text);
  EXPECT_EQ(core::toml_text(again), text);
  const auto motion = again.kind_options().build(world_.context());
  EXPECT_EQ(motion->at(1.0).world_from_body, motion_->at(1.0).world_from_body);
}

TEST_P(TrajectoryLaws, PathsUnderGroundOrOutsideTheWorldAreRefused) {
  GroundWorld high = world_;
  // Places above ground would rise with it, so it rises only after they were looked up.
  int calls = 0;
  high.ground = [&](double lat_deg, double lon_deg) {
    return std::optional(++calls > 60 ? 5000.0 : *world_.ground(lat_deg, lon_deg));
  };
  // A kind that lays its path out over the ground may fly over the new one; then it keeps clear of it.
  try {
    const auto motion = options_.kind_options().build(high.context());
    for (int i = 0; i <= 1000; ++i) {
      const MotionState state = motion->at(motion->duration_s() * i / 1000);
      ASSERT_GE(test::agl_m(high, state.world_from_body.translation), 5.0 - 0.01);
    }
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Input);
    const std::string low = error.what();
    EXPECT_NE(low.find("below the ground at t = "), std::string::npos) << low;
    EXPECT_NE(low.find("lat 42."), std::string::npos) << low;
    EXPECT_NE(low.find("raise "), std::string::npos) << low;
  }

  GroundWorld small = world_;
  calls = 0;
  small.ground = [&](double lat_deg, double lon_deg) {
    return ++calls > 60 ? std::nullopt : world_.ground(lat_deg, lon_deg);
  };
  const std::string outside = test::message_of(
      core::ErrorKind::Input, [&] { options_.kind_options().build(small.context()); });
  EXPECT_NE(outside.find("leaves the world"), std::string::npos) << outside;
}

std::vector<std::tuple<std::string, std::string>> kinds_and_continuities() {
  std::vector<std::tuple<std::string, std::string>> result;
  for (const TrajectoryKindInfo& info : trajectory_kinds()) {
    const std::string kind(info.name);
    if (has_continuity_key(kind)) result.emplace_back(kind, "second");
    result.emplace_back(kind, "fourth");
  }
  result.emplace_back("quadrotor_flown", "fourth");
  result.emplace_back("fixed_wing_flown", "fourth");
  return result;
}

INSTANTIATE_TEST_SUITE_P(AllKinds, TrajectoryLaws, testing::ValuesIn(kinds_and_continuities()),
                         [](const auto& kind) {
                           return std::get<0>(kind.param) + "_" + std::get<1>(kind.param);
                         });

}  // namespace
}  // namespace terracast::geo
