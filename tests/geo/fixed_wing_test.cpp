// Forces, trim and linear modes of fixed-wing aircraft against closed forms and runs of their own.

#include "geo/vehicles/fixed_wing.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "core/toml_reader.h"
#include "geo/vehicles/rigid_body.h"
#include "geo/vehicles/trim.h"
#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
using test::message_of;
using Body = Eigen::Matrix<double, rigid_state::kSize, 1>;

constexpr const char* kSets[] = {"aerosonde_beard_mclain.toml", "zagi_beard_mclain.toml"};

FixedWing shipped(const std::string& name) {
  FixedWing vehicle;
  core::TomlDocument::load(TERRACAST_SOURCE_DIR "/configs/vehicles/" + name).read(vehicle);
  vehicle.validate();
  return vehicle;
}

double usual_mps(const FixedWing& vehicle) { return vehicle.mass_kg > 5.0 ? 25.0 : 13.0; }

/// A flight by the rigid body's equations over a flat Earth that does not turn.
Body rates_of(const FixedWing& vehicle, const SteadyFlight& flight, const WingControls& controls,
              const Body& body) {
  const Eigen::Quaterniond rotation = rotation_in(body);
  const Vector3d velocity = body.segment<3>(rigid_state::kVelocity);
  const WingForces forces =
      wing_forces(vehicle,
                  {.through_air_body_mps = rotation.conjugate() * velocity,
                   .turn_rate_body_radps = body.segment<3>(rigid_state::kTurnRate),
                   .density_kg_per_m3 = flight.density_kg_per_m3},
                  controls);
  const Eigen::Matrix3d inertia = vehicle.inertia_body_kg_m2();
  Body rates = Body::Zero();
  set_rigid_rates(body,
                  Vector3d(rotation * forces.force_body_n / vehicle.mass_kg -
                           flight.gravity_mps2 * Vector3d::UnitZ()),
                  forces.moment_body_nm, inertia, Eigen::Matrix3d(inertia.inverse()),
                  Vector3d::Zero(), rates);
  return rates;
}

Body begin_of(const Trim& trim) {
  Body body = Body::Zero();
  set_rotation(body, trim.world_from_body);
  body.segment<3>(rigid_state::kVelocity) = trim.world_from_body * trim.velocity_body_mps;
  body.segment<3>(rigid_state::kTurnRate) = trim.turn_rate_body_radps;
  return body;
}

Body stepped(const FixedWing& vehicle, const Trim& trim, const Body& body, double step_s) {
  return runge_kutta_step(body, 0.0, step_s, [&](double, const Body& at) {
    return rates_of(vehicle, trim.flight, trim.controls, at);
  });
}

// --- Forces -------------------------------------------------------------------------------------

// The book's formulas (4.6) to (4.20) written out in its own axes, forward, right and down.
TEST(FixedWing, ForcesAreTheBooksFormulas) {
  for (const char* name : kSets) {
    const FixedWing v = shipped(name);
    const double rho = 1.1, speed = 17.0;
    for (const double alpha : {-0.7, -0.2, 0.0, 0.1, 0.3, 0.46, 0.6, 1.2}) {
      const double beta = 0.3 * alpha - 0.05;
      const double u = speed * std::cos(alpha) * std::cos(beta), side = speed * std::sin(beta),
                   w = speed * std::sin(alpha) * std::cos(beta);
      const double p = 0.3, q = -0.2, r = 0.4, e = 0.11, a = -0.07, d = 0.05, t = 0.6;
      const WingForces forces =
          wing_forces(v,
                      {.through_air_body_mps = {u, -side, -w},
                       .turn_rate_body_radps = {p, -q, -r},
                       .density_kg_per_m3 = rho},
                      {.elevator_rad = e, .aileron_rad = a, .rudder_rad = d, .throttle = t});
      const double stall = v.stall_deg * std::numbers::pi / 180.0, m = v.stall_sharpness;
      const double low = std::exp(-m * (alpha - stall)), high = std::exp(m * (alpha + stall));
      const double sigma = (1.0 + low + high) / ((1.0 + low) * (1.0 + high));
      const double linear = v.lift.zero + v.lift.alpha_per_rad * alpha;
      const double plate =
          2.0 * (alpha < 0.0 ? -1.0 : 1.0) * std::pow(std::sin(alpha), 2) * std::cos(alpha);
      const double pressure = 0.5 * rho * speed * speed * v.wing_area_m2;
      const double q_hat = v.chord_m * q / (2.0 * speed), p_hat = v.span_m * p / (2.0 * speed),
                   r_hat = v.span_m * r / (2.0 * speed);
      const double lift = pressure * ((1.0 - sigma) * linear + sigma * plate +
                                      v.lift.q_per_rad * q_hat + v.lift.elevator_per_rad * e);
      const double aspect = v.span_m * v.span_m / v.wing_area_m2;
      const double drag =
          pressure *
          (v.drag.parasitic + linear * linear / (std::numbers::pi * v.drag.oswald * aspect));
      const double thrust =
          0.5 * rho * v.propeller.area_m2 * (std::pow(v.propeller.full_mps * t, 2) - speed * speed);
      const auto lateral = [&](const SideCoefficients& c) {
        return pressure * (c.zero + c.beta_per_rad * beta + c.p_per_rad * p_hat +
                           c.r_per_rad * r_hat + c.aileron_per_rad * a + c.rudder_per_rad * d);
      };
      const double pitch = pressure * v.chord_m *
                           (v.pitch.zero + v.pitch.alpha_per_rad * alpha +
                            v.pitch.q_per_rad * q_hat + v.pitch.elevator_per_rad * e);
      const Vector3d force(thrust - drag * std::cos(alpha) + lift * std::sin(alpha),
                           lateral(v.side), -drag * std::sin(alpha) - lift * std::cos(alpha));
      const Vector3d moment(v.span_m * lateral(v.roll), pitch, v.span_m * lateral(v.yaw));
      const Vector3d turned(1.0, -1.0, -1.0);
      EXPECT_LT((forces.force_body_n - turned.cwiseProduct(force)).norm(), 1e-11 * force.norm());
      EXPECT_LT((forces.moment_body_nm - turned.cwiseProduct(moment)).norm(), 1e-11 * force.norm());
    }
  }
}

TEST(FixedWing, LiftEndsAtTheStall) {
  const FixedWing v = shipped(kSets[0]);
  const double most_rad = v.alpha_of_most_lift_rad();
  EXPECT_LT(most_rad, v.stall_deg * std::numbers::pi / 180.0);
  EXPECT_GT(most_rad, 0.8 * v.stall_deg * std::numbers::pi / 180.0);
  for (double alpha = -0.2; alpha < 0.7; alpha += 1e-4)
    ASSERT_LE(v.lift_coefficient(alpha), v.lift_coefficient(most_rad) + 1e-4);
  // A flat plate's, well behind it.
  EXPECT_NEAR(v.lift_coefficient(0.8), 2.0 * std::pow(std::sin(0.8), 2) * std::cos(0.8), 1e-6);
}

TEST(FixedWing, ThrottleAndThrustAreEachOthersInverse) {
  const FixedWing v = shipped(kSets[0]);
  for (const double throttle : {0.0, 0.2, 0.7, 1.0})
    EXPECT_NEAR(v.throttle_of(v.thrust_n(throttle, 24.0, 1.2), 24.0, 1.2), throttle, 1e-12);
  EXPECT_LT(v.throttle_of(-200.0, 24.0, 1.2), 0.0);
}

// --- Trim ---------------------------------------------------------------------------------------

TEST(Trim, NothingAcceleratesInIt) {
  for (const char* name : kSets) {
    const FixedWing v = shipped(name);
    for (const double climb_deg : {-3.0, 0.0, 4.0})
      for (const double bank_deg : {-35.0, 0.0, 20.0}) {
        SteadyFlight flight{.airspeed_mps = usual_mps(v),
                            .climb_rad = climb_deg * std::numbers::pi / 180.0};
        flight.turn_radps = -flight.gravity_mps2 / flight.airspeed_mps *
                            std::tan(bank_deg * std::numbers::pi / 180.0);
        const Trim trim = trimmed(v, flight);
        const Body rates = rates_of(v, flight, trim.controls, begin_of(trim));
        // Velocity turns about the vertical and changes no further.
        const Vector3d velocity = trim.world_from_body * trim.velocity_body_mps;
        const Vector3d turning = flight.turn_radps * Vector3d::UnitZ().cross(velocity);
        EXPECT_LT((rates.segment<3>(rigid_state::kVelocity) - turning).norm(), 1e-10) << name;
        EXPECT_LT(rates.segment<3>(rigid_state::kTurnRate).norm(), 1e-10) << name;
        EXPECT_NEAR(velocity.norm(), flight.airspeed_mps, 1e-12 * flight.airspeed_mps);
        EXPECT_NEAR(velocity.z() / velocity.norm(), std::sin(flight.climb_rad), 1e-11);
      }
  }
}

// For a minute as it began: on a circle, and on a helix.
TEST(Trim, IsFlownAsACircle) {
  const FixedWing v = shipped(kSets[0]);
  const double bank_rad = 0.5;
  SteadyFlight flight{.airspeed_mps = 25.0, .climb_rad = 0.05};
  flight.turn_radps = flight.gravity_mps2 / flight.airspeed_mps * std::tan(bank_rad);
  const Trim trim = trimmed(v, flight);
  const Body begin = begin_of(trim);
  Body body = begin;
  for (int i = 0; i < 60000; ++i) body = stepped(v, trim, body, 1e-3);
  const Vector3d velocity = begin.segment<3>(rigid_state::kVelocity);
  const double turned_rad = 60.0 * flight.turn_radps;
  const Vector3d level(velocity.x(), velocity.y(), 0.0);
  const Vector3d left = Vector3d::UnitZ().cross(level);
  const Vector3d place =
      (std::sin(turned_rad) * level + (1.0 - std::cos(turned_rad)) * left) / flight.turn_radps +
      60.0 * velocity.z() * Vector3d::UnitZ();
  EXPECT_LT((body.segment<3>(rigid_state::kPosition) - place).norm(), 1e-6);
}

// Without side force the lift's plane is that of the bank: R = V^2 / (g tan(bank)) and n = 1 / cos(bank), where bank is
// that of the force about the path.
TEST(Trim, ALevelTurnHasTheRadiusOfItsBank) {
  const FixedWing v = shipped(kSets[0]);
  for (const double turn_radps : {0.1, -0.3}) {
    const SteadyFlight flight{.airspeed_mps = 25.0, .turn_radps = turn_radps};
    const Trim trim = trimmed(v, flight);
    const Body rates = rates_of(v, flight, trim.controls, begin_of(trim));
    const Vector3d velocity = trim.world_from_body * trim.velocity_body_mps;
    const Vector3d specific = Vector3d(rates.segment<3>(rigid_state::kVelocity)) +
                              flight.gravity_mps2 * Vector3d::UnitZ();
    EXPECT_NEAR(specific.dot(trim.world_from_body * Vector3d::UnitY()), 0.0, 1e-9);
    EXPECT_NEAR(specific.dot(velocity), 0.0, 1e-8);
    const double bank_rad = std::acos(specific.normalized().z());
    const double radius_m = 25.0 / std::abs(turn_radps);
    EXPECT_NEAR(radius_m, 25.0 * 25.0 / (flight.gravity_mps2 * std::tan(bank_rad)),
                1e-9 * radius_m);
    EXPECT_NEAR(specific.norm() / flight.gravity_mps2, 1.0 / std::cos(bank_rad), 1e-9);
    // That of the body lacks the nose's angle to the path.
    EXPECT_NEAR(std::abs(trim.bank_rad()), bank_rad, 0.02);
    EXPECT_EQ(trim.bank_rad() > 0.0, turn_radps < 0.0);
  }
}

TEST(Trim, LiftAndThrustCarryAStraightClimb) {
  const FixedWing v = shipped(kSets[1]);
  const SteadyFlight flight{.airspeed_mps = 13.0, .climb_rad = 0.08};
  const Trim trim = trimmed(v, flight);
  const WingForces forces = wing_forces(v,
                                        {.through_air_body_mps = trim.velocity_body_mps,
                                         .turn_rate_body_radps = trim.turn_rate_body_radps,
                                         .density_kg_per_m3 = flight.density_kg_per_m3},
                                        trim.controls);
  const double weight_n = v.mass_kg * flight.gravity_mps2;
  const double alpha = trim.alpha_rad();
  EXPECT_NEAR(forces.lift_n + forces.thrust_n * std::sin(alpha), weight_n * std::cos(0.08), 1e-9);
  EXPECT_NEAR(forces.thrust_n * std::cos(alpha) - forces.drag_n, weight_n * std::sin(0.08), 1e-9);
  EXPECT_NEAR(trim.pitch_rad(), 0.08 + alpha, 1e-10);
}

TEST(Trim, RefusesWhatCannotBeFlown) {
  const FixedWing v = shipped(kSets[1]);
  const auto message = [&](const SteadyFlight& flight) {
    return message_of(ErrorKind::Input, [&] { trimmed(v, flight); });
  };
  // 1.56 kg on 0.2589 m^2 at 4 m/s: a lift coefficient of 6.
  const std::string slow = message({.airspeed_mps = 4.0});
  EXPECT_TRUE(slow.find("there is no steady flight") != std::string::npos ||
              slow.find("needs") != std::string::npos)
      << slow;
  EXPECT_NE(message({.airspeed_mps = 13.0, .climb_rad = 0.6}).find("throttle"), std::string::npos);
}

// --- Energy and modes ---------------------------------------------------------------------------

// Straight ahead: d(V^2 / 2 + g h)/dt = (T cos(alpha) - D) V / m, by the states of a run that is far from trim.
TEST(FixedWing, EnergyChangesByThrustLessDragTimesSpeed) {
  const FixedWing v = shipped(kSets[0]);
  Trim trim = trimmed(v, {.airspeed_mps = 25.0});
  trim.controls.throttle += 0.02;
  trim.controls.elevator_rad -= 0.02;
  Body body = begin_of(trim);
  const double step_s = 1e-3;
  std::vector<double> energies_j, powers_w;
  for (int i = 0; i < 4000; ++i) {
    const Vector3d velocity = body.segment<3>(rigid_state::kVelocity);
    const Airflow flow{.through_air_body_mps = rotation_in(body).conjugate() * velocity,
                       .turn_rate_body_radps = body.segment<3>(rigid_state::kTurnRate),
                       .density_kg_per_m3 = trim.flight.density_kg_per_m3};
    const WingForces forces = wing_forces(v, flow, trim.controls);
    energies_j.push_back(v.mass_kg *
                         (0.5 * velocity.squaredNorm() + trim.flight.gravity_mps2 * body[2]));
    powers_w.push_back((forces.thrust_n * std::cos(flow.alpha_rad()) - forces.drag_n) *
                       velocity.norm());
    body = stepped(v, trim, body, step_s);
  }
  double most_w = 0.0;
  for (const double power : powers_w) most_w = std::max(most_w, std::abs(power));
  EXPECT_GT(most_w, 50.0);
  // Its integral over 4 s by Simpson's rule: 1e-9 of the energy.
  double work_j = powers_w.front() + powers_w[3998];
  for (int i = 1; i < 3998; ++i)
    work_j += (i % 2 == 1 ? 4.0 : 2.0) * powers_w[static_cast<std::size_t>(i)];
  work_j *= step_s / 3.0;
  EXPECT_NEAR(energies_j[3998] - energies_j[0], work_j, 1e-9 * energies_j[0]);
}

/// Eigenvalues of the linear motion in the plane of symmetry (states u, w, q, pitch), or across it.
std::vector<std::complex<double>> modes_of(const FixedWing& vehicle, const Trim& trim,
                                           bool is_in_plane) {
  const Eigen::Matrix<double, 8, 8> slopes = linearised(vehicle, trim);
  const std::array<int, 4> in_plane = {0, 2, 4, 6}, across = {1, 3, 5, 7};
  const std::array<int, 4>& states = is_in_plane ? in_plane : across;
  const std::array<int, 4>& others = is_in_plane ? across : in_plane;
  Eigen::Matrix4d part;
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k) {
      part(i, k) = slopes(states[static_cast<std::size_t>(i)], states[static_cast<std::size_t>(k)]);
      EXPECT_NEAR(slopes(states[static_cast<std::size_t>(i)], others[static_cast<std::size_t>(k)]),
                  0.0, 1e-6);
    }
  const Eigen::Vector4cd values = part.eigenvalues();
  return {values.begin(), values.end()};
}

/// The oscillation among modes, the fastest or the slowest one.
std::complex<double> oscillation_of(const std::vector<std::complex<double>>& modes,
                                    bool is_fastest) {
  std::complex<double> found = 0.0;
  for (const auto& mode : modes)
    if (mode.imag() > 1e-6 && (found == 0.0 || (std::abs(mode) > std::abs(found)) == is_fastest))
      found = mode;
  return found;
}

/// A shifted run's value over time less that of the trim.
using Watch = double (*)(const Body&);
std::vector<double> run_after(const FixedWing& vehicle, const Trim& trim, Body body, double seconds,
                              double step_s, Watch watch) {
  std::vector<double> values;
  for (double t = 0.0; t < seconds; t += step_s) {
    values.push_back(watch(body));
    body = stepped(vehicle, trim, body, step_s);
  }
  return values;
}

/// The frequency and damping of a ringing value: a least-squares fit of y'' + 2 z w y' + w^2 y = 0 to samples, by the
/// linear recursion y(k+1) = a y(k) - b y(k-1) that any such motion keeps without approximation.
std::complex<double> ringing(const std::vector<double>& values, std::size_t from,
                             std::size_t stride, double step_s) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (std::size_t i = from + stride; i + stride < values.size(); ++i) {
    const Eigen::Vector2d row(values[i], -values[i - stride]);
    normal += row * row.transpose();
    right += row * values[i + stride];
  }
  const Eigen::Vector2d ab = normal.ldlt().solve(right);
  const std::complex<double> root =
      0.5 * (ab[0] + std::sqrt(std::complex<double>(ab[0] * ab[0] - 4.0 * ab[1])));
  return std::log(root) / (static_cast<double>(stride) * step_s);
}

/// An Aerosonde whose thrust hardly depends on the airspeed, as the phugoid's closed forms have it.
FixedWing with_steady_thrust() {
  FixedWing vehicle = shipped(kSets[0]);
  vehicle.propeller = {.area_m2 = 1e-6, .coefficient = 1.0, .full_mps = 3e4};
  return vehicle;
}

TEST(FixedWing, ThePhugoidRingsAsItsEigenvalueSays) {
  const FixedWing v = with_steady_thrust();
  const Trim trim = trimmed(v, {.airspeed_mps = 25.0});
  const std::complex<double> mode = oscillation_of(modes_of(v, trim, true), false);
  ASSERT_GT(mode.imag(), 0.1);
  Body body = begin_of(trim);
  body[rigid_state::kVelocity] += 0.02;
  // The fast modes are gone after 6 s; climbing is what the phugoid shows best.
  const auto values = run_after(v, trim, body, 60.0, 5e-3,
                                [](const Body& b) { return b[rigid_state::kVelocity + 2]; });
  const std::complex<double> seen = ringing(values, 1200, 400, 5e-3);
  EXPECT_NEAR(seen.imag() / mode.imag(), 1.0, 0.01);
  EXPECT_NEAR(seen.real() / mode.real(), 1.0, 0.01);
  RecordProperty("mode", fmt::format("{} {}", mode.real(), mode.imag()));
}

TEST(FixedWing, TheShortPeriodRingsAsItsEigenvalueSays) {
  const FixedWing v = with_steady_thrust();
  const Trim trim = trimmed(v, {.airspeed_mps = 25.0});
  const std::complex<double> mode = oscillation_of(modes_of(v, trim, true), true);
  ASSERT_GT(mode.imag(), 1.0);
  // Along its own eigenvector, so that nothing else rings.
  const Eigen::EigenSolver<Eigen::Matrix<double, 8, 8>> solver(linearised(v, trim));
  int which = 0;
  for (int i = 0; i < 8; ++i)
    if (std::abs(solver.eigenvalues()[i] - mode) < std::abs(solver.eigenvalues()[which] - mode))
      which = i;
  const Eigen::Matrix<double, 8, 1> shape = 1e-4 * solver.eigenvectors().col(which).real();
  Body body = begin_of(trim);
  const Eigen::Quaterniond attitude =
      trim.world_from_body * Eigen::AngleAxisd(-shape[6], Vector3d::UnitY());
  set_rotation(body, attitude);
  body.segment<3>(rigid_state::kVelocity) =
      attitude * Vector3d(trim.velocity_body_mps + shape.head<3>());
  body.segment<3>(rigid_state::kTurnRate) += shape.segment<3>(3);
  const auto values = run_after(v, trim, body, 3.0 / -mode.real(), 1e-3,
                                [](const Body& b) { return b[rigid_state::kTurnRate + 1]; });
  const std::complex<double> seen =
      ringing(values, 0, static_cast<std::size_t>(0.3 / mode.imag() / 1e-3), 1e-3);
  EXPECT_NEAR(seen.imag() / mode.imag(), 1.0, 0.01);
  EXPECT_NEAR(seen.real() / mode.real(), 1.0, 0.01);
  RecordProperty("mode", fmt::format("{} {}", mode.real(), mode.imag()));
}

TEST(FixedWing, TheDutchRollRingsAsItsEigenvalueSays) {
  const FixedWing v = shipped(kSets[0]);
  const Trim trim = trimmed(v, {.airspeed_mps = 25.0});
  const std::complex<double> mode = oscillation_of(modes_of(v, trim, false), true);
  ASSERT_GT(mode.imag(), 1.0);
  const Eigen::EigenSolver<Eigen::Matrix<double, 8, 8>> solver(linearised(v, trim));
  int which = 0;
  for (int i = 0; i < 8; ++i)
    if (std::abs(solver.eigenvalues()[i] - mode) < std::abs(solver.eigenvalues()[which] - mode))
      which = i;
  const Eigen::Matrix<double, 8, 1> shape = 1e-4 * solver.eigenvectors().col(which).real();
  Body body = begin_of(trim);
  const Eigen::Quaterniond attitude =
      trim.world_from_body * Eigen::AngleAxisd(shape[7], Vector3d::UnitX());
  set_rotation(body, attitude);
  body.segment<3>(rigid_state::kVelocity) =
      attitude * Vector3d(trim.velocity_body_mps + shape.head<3>());
  body.segment<3>(rigid_state::kTurnRate) += shape.segment<3>(3);
  const auto values = run_after(v, trim, body, 3.0 / -mode.real(), 1e-3,
                                [](const Body& b) { return b[rigid_state::kTurnRate + 2]; });
  const std::complex<double> seen =
      ringing(values, 0, static_cast<std::size_t>(0.3 / mode.imag() / 1e-3), 1e-3);
  EXPECT_NEAR(seen.imag() / mode.imag(), 1.0, 0.01);
  EXPECT_NEAR(seen.real() / mode.real(), 1.0, 0.01);
}

// Lanchester: a nose that follows the path at once. Period pi sqrt(2) V / g, damping 1 / (sqrt(2) L/D).
TEST(FixedWing, ThePhugoidOfAStiffAircraftIsLanchesters) {
  FixedWing v = with_steady_thrust();
  v.pitch.alpha_per_rad = -20.0;
  v.pitch.elevator_per_rad = -10.0;
  v.pitch.q_per_rad = 0.0;
  const Trim trim = trimmed(v, {.airspeed_mps = 25.0});
  const std::complex<double> mode = oscillation_of(modes_of(v, trim, true), false);
  const double g = trim.flight.gravity_mps2;
  EXPECT_NEAR(2.0 * std::numbers::pi / std::abs(mode), std::numbers::pi * std::sqrt(2.0) * 25.0 / g,
              0.1 * 11.3);
  const WingForces forces = wing_forces(v,
                                        {.through_air_body_mps = trim.velocity_body_mps,
                                         .turn_rate_body_radps = Vector3d::Zero(),
                                         .density_kg_per_m3 = trim.flight.density_kg_per_m3},
                                        trim.controls);
  const double damping = -mode.real() / std::abs(mode);
  EXPECT_NEAR(damping * std::sqrt(2.0) * forces.lift_n / forces.drag_n, 1.0, 0.1);
}

TEST(FixedWing, RefusesWhatIsNoAircraft) {
  FixedWing v;
  EXPECT_NE(message_of(ErrorKind::Config, [&] { v.validate(); }).find("an aircraft needs mass_kg"),
            std::string::npos);
  v = shipped(kSets[0]);
  v.inertia_kg_m2 = {0.8, 1.1, 175.9};
  EXPECT_NE(message_of(ErrorKind::Config, [&] { v.validate(); }).find("is that of no body"),
            std::string::npos);
  v = shipped(kSets[0]);
  v.propeller.full_mps = 0.0;
  EXPECT_NE(message_of(ErrorKind::Config, [&] { v.validate(); }).find("propeller.area_m2"),
            std::string::npos);
}

}  // namespace
}  // namespace terracast::geo
