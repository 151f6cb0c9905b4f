#include "geo/vehicles/flown_quadrotor.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/toml_reader.h"
#include "geo/gravity.h"
#include "geo/paths/attitude.h"
#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
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

// --- A rigid body without moments ---------------------------------------------------------------

struct Elliptic {
  double sn, cn, dn;
};
/// Jacobi's functions by the arithmetic-geometric mean (Abramowitz and Stegun, 16.4).
Elliptic jacobi(double u, double k) {
  double a[12] = {1.0}, c[12] = {k};
  double b = std::sqrt(1.0 - k * k);
  int n = 0;
  for (; c[n] > 1e-17 && n < 11; ++n) {
    a[n + 1] = 0.5 * (a[n] + b);
    c[n + 1] = 0.5 * (a[n] - b);
    b = std::sqrt(a[n] * b);
  }
  double phi = std::ldexp(a[n] * u, n);
  for (; n > 0; --n) phi = 0.5 * (phi + std::asin(c[n] / a[n] * std::sin(phi)));
  const double sn = std::sin(phi);
  return {sn, std::cos(phi), std::sqrt(1.0 - k * k * sn * sn)};
}

/// A free body that turns about its axis of the largest moment of inertia, J.x < J.y < J.z.
class FreeTumbling {
 public:
  FreeTumbling(const Vector3d& inertia, const Vector3d& turn_rate) : j_(inertia) {
    const double energy2 = inertia.dot(turn_rate.cwiseAbs2());
    const double square = inertia.cwiseProduct(turn_rate).squaredNorm();
    momentum_ = std::sqrt(square);
    const double x = j_.x(), y = j_.y(), z = j_.z();
    const double less = energy2 * z - square, more = square - energy2 * x;
    EXPECT_GT(square, energy2 * y);
    size_ = {std::sqrt(less / (x * (z - x))), std::sqrt(less / (y * (z - y))),
             std::sqrt(more / (z * (z - x)))};
    rate_ = std::sqrt((z - y) * more / (x * y * z));
    k_ = std::sqrt((y - x) * less / ((z - y) * more));
    start_ = std::ellint_1(k_, std::asin(turn_rate.y() / size_.y()));
  }
  Vector3d turn_rate(double time_s) const {
    const Elliptic e = jacobi(start_ + rate_ * time_s, k_);
    return {size_.x() * e.cn, size_.y() * e.sn, size_.z() * e.dn};
  }
  /// Attitude against axes of which z is along the momentum: by its nutation and spin, which follow from the turn rate, and
  /// the precession, whose rate is integrated (Simpson).
  Eigen::Quaterniond attitude(double time_s) const {
    constexpr int kParts = 3000;
    const auto precession = [&](double t) {
      const Vector3d w = turn_rate(t);
      const Vector3d l = j_.cwiseProduct(w);
      return momentum_ * (j_.x() * w.x() * w.x() + j_.y() * w.y() * w.y()) /
             l.head<2>().squaredNorm();
    };
    const double step = time_s / kParts;
    double angle = 0.0;
    for (int i = 0; i < kParts; ++i)
      angle +=
          step / 6.0 *
          (precession(i * step) + 4.0 * precession((i + 0.5) * step) + precession((i + 1) * step));
    const Vector3d l = j_.cwiseProduct(turn_rate(time_s)) / momentum_;
    return Eigen::AngleAxisd(angle, Vector3d::UnitZ()) *
           Eigen::AngleAxisd(std::acos(l.z()), Vector3d::UnitX()) *
           Eigen::AngleAxisd(std::atan2(l.x(), l.y()), Vector3d::UnitZ());
  }

 private:
  Vector3d j_, size_;
  double momentum_, rate_, k_, start_;
};

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
  const FlightAir air{
      .wind = WindField({.speed_mps = wind_mps, .from_deg = 270.0, .profile = "even"}, 1e4, 10.0),
      .ground_height_m = [](double) { return 1000.0; }};
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

constexpr const char* kTurbulent = R"(
[wind]
speed_mps = 5.0
from_deg = 200.0
turbulence = "dryden"
seed = 4
gusts = [{ start_m = 30.0, length_m = 10.0, left_mps = 2.0 }]
)";

TEST(FlownQuadrotor, WithoutWindAndLagItKeepsToItsPath) {
  const GroundWorld world;
  Quadrotor ideal = shipped_vehicle("hummingbird_rotors.toml");
  ideal.rotor_lag_up_s = ideal.rotor_lag_down_s = 0.0;
  std::string flat = flown_text("hummingbird_rotors.toml", "");
  flat.replace(flat.find("flown"), 5, "flat");
  const auto plan = trajectory_from(flat, world);
  FlightReport report;
  const auto motion = fly(world.frame, *plan, ideal, {}, nullptr, 1.0, report);
  EXPECT_LT(report.most_off_m, 0.02);
  double most_rad = 0.0;
  for (int i = 0; i <= 100; ++i) {
    const double time_s = motion->duration_s() * i / 100;
    most_rad = std::max(most_rad,
                        rotation_vector_of(plan->at(time_s).world_from_body.rotation.conjugate() *
                                           motion->at(time_s).world_from_body.rotation)
                            .norm());
  }
  EXPECT_LT(most_rad, 0.02);
  RecordProperty("most_off_m", fmt::format("{:.2g}", report.most_off_m));
  RecordProperty("most_rad", fmt::format("{:.2g}", most_rad));
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
    const Quadrotor vehicle = shipped_vehicle(entry.path().filename().string());
    const FlightAir air{
        .wind = WindField({.speed_mps = 2.0, .from_deg = 90.0, .profile = "even"}, 1e4, 10.0),
        .ground_height_m = [](double) { return 1000.0; }};
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
  std::string weak = flown_text(set, "max_off_m = 0.5\nmax_acceleration_mps2 = 0.5\n",
                                "[wind]\ngusts = [{ start_m = 4.0, length_m = 0.5, left_mps = "
                                "100.0 }]\n[vehicle]\nextends = \"");
  const std::size_t line = weak.find("vehicle = "), line_end = weak.find('\n', line);
  const std::string path = weak.substr(line + 11, line_end - line - 12);
  weak.erase(line, line_end - line);
  const std::string blown =
      message(ErrorKind::Input, weak + path + "\"\nmax_rotor_radps = 480.0\n");
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
