#include "geo/vehicles/trim.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;
using Unknowns =
    Eigen::Matrix<double, 8, 1>;  ///< alpha, beta, pitch, bank, elevator, aileron, rudder, throttle
using FlightState = Eigen::Matrix<double, 8, 1>;  ///< velocity, turn rate, pitch, bank

/// pitch   nose up;  bank   right wing down; heading along x.
Eigen::Quaterniond attitude_of(double pitch_rad, double bank_rad) {
  return Eigen::AngleAxisd(-pitch_rad, Vector3d::UnitY()) *
         Eigen::AngleAxisd(bank_rad, Vector3d::UnitX());
}

Vector3d velocity_of(double airspeed_mps, double alpha_rad, double beta_rad) {
  return airspeed_mps * Vector3d(std::cos(alpha_rad) * std::cos(beta_rad), -std::sin(beta_rad),
                                 -std::sin(alpha_rad) * std::cos(beta_rad));
}

/// Accelerations of the body in its own axes: as velocity and turn rate change there.
struct Accelerations {
  Vector3d velocity, turn_rate;
  double side_force_n;
};

Accelerations accelerations_of(const FixedWing& vehicle, const SteadyFlight& flight,
                               const Eigen::Quaterniond& world_from_body, const Vector3d& velocity,
                               const Vector3d& turn_rate, const WingControls& controls) {
  const WingForces forces = wing_forces(vehicle,
                                        {.through_air_body_mps = velocity,
                                         .turn_rate_body_radps = turn_rate,
                                         .density_kg_per_m3 = flight.density_kg_per_m3},
                                        controls);
  const Vector3d weight = world_from_body.conjugate() * Vector3d(0.0, 0.0, -flight.gravity_mps2);
  const Eigen::Matrix3d inertia = vehicle.inertia_body_kg_m2();
  return {forces.force_body_n / vehicle.mass_kg + weight - turn_rate.cross(velocity),
          inertia.inverse() * (forces.moment_body_nm - turn_rate.cross(inertia * turn_rate)),
          forces.force_body_n.y()};
}

Trim trim_of(const SteadyFlight& flight, const Unknowns& x) {
  const Eigen::Quaterniond attitude = attitude_of(x[2], x[3]);
  return {.flight = flight,
          .world_from_body = attitude,
          .velocity_body_mps = velocity_of(flight.airspeed_mps, x[0], x[1]),
          .turn_rate_body_radps = attitude.conjugate() * Vector3d(0.0, 0.0, flight.turn_radps),
          .controls = {
              .elevator_rad = x[4], .aileron_rad = x[5], .rudder_rad = x[6], .throttle = x[7]}};
}

/// What is 0 in trim: accelerations, the climb that lacks, and the side force or the rudder.
Unknowns lacking(const FixedWing& vehicle, const SteadyFlight& flight, const Unknowns& x) {
  const Trim trim = trim_of(flight, x);
  const Accelerations rates =
      accelerations_of(vehicle, flight, trim.world_from_body, trim.velocity_body_mps,
                       trim.turn_rate_body_radps, trim.controls);
  Unknowns lack;
  lack << rates.velocity, rates.turn_rate,
      (trim.world_from_body * trim.velocity_body_mps).z() / flight.airspeed_mps -
          std::sin(flight.climb_rad),
      vehicle.has_rudder() ? rates.side_force_n / vehicle.mass_kg : x[6];
  return lack;
}

void check_limits(const FixedWing& vehicle, const Trim& trim) {
  const auto refuse = [&](const char* what, double value, double least, double most,
                          const char* unit) {
    core::fail(core::ErrorKind::Input,
               "steady flight at {:.1f} m/s, climbing by {:.1f} deg and turning by {:.1f} deg/s, "
               "needs {} = {:.3g} {}, beyond {:.3g} to {:.3g}",
               trim.flight.airspeed_mps, degrees_from_radians(trim.flight.climb_rad),
               degrees_from_radians(trim.flight.turn_radps), what, value, unit, least, most);
  };
  const double most_deg = vehicle.max_deflection_deg;
  for (const auto& [what, angle_rad] : {std::pair{"elevator", trim.controls.elevator_rad},
                                        {"aileron", trim.controls.aileron_rad},
                                        {"rudder", trim.controls.rudder_rad}})
    if (std::abs(degrees_from_radians(angle_rad)) > most_deg)
      refuse(what, degrees_from_radians(angle_rad), -most_deg, most_deg, "deg");
  if (!(trim.controls.throttle >= 0.0 && trim.controls.throttle <= 1.0))
    refuse("throttle", trim.controls.throttle, 0.0, 1.0, "");
  const double stall_rad = vehicle.alpha_of_most_lift_rad();
  if (trim.alpha_rad() > stall_rad)
    refuse("an angle of attack", degrees_from_radians(trim.alpha_rad()), -90.0,
           degrees_from_radians(stall_rad), "deg");
}

}  // namespace

double Trim::alpha_rad() const { return std::atan2(-velocity_body_mps.z(), velocity_body_mps.x()); }
double Trim::beta_rad() const {
  return std::asin(-velocity_body_mps.y() / velocity_body_mps.norm());
}
double Trim::pitch_rad() const { return std::asin((world_from_body * Vector3d::UnitX()).z()); }
double Trim::bank_rad() const {
  const Vector3d up = world_from_body.conjugate() * Vector3d::UnitZ();
  return std::atan2(up.y(), up.z());
}

Trim trimmed(const FixedWing& vehicle, const SteadyFlight& flight) {
  TERRACAST_CHECK(flight.airspeed_mps > 0.0, "a steady flight at {} m/s", flight.airspeed_mps);
  vehicle.validate();
  const double pressure_n = 0.5 * flight.density_kg_per_m3 * flight.airspeed_mps *
                            flight.airspeed_mps * vehicle.wing_area_m2;
  const double bank_rad = -std::atan(flight.airspeed_mps * flight.turn_radps / flight.gravity_mps2);
  const double lift = vehicle.mass_kg * flight.gravity_mps2 / (pressure_n * std::cos(bank_rad));
  Unknowns x = Unknowns::Zero();
  x[0] = std::clamp((lift - vehicle.lift.zero) / vehicle.lift.alpha_per_rad, -0.3,
                    vehicle.alpha_of_most_lift_rad());
  x[2] = flight.climb_rad + x[0] * std::cos(bank_rad);
  x[3] = bank_rad;
  x[4] =
      -(vehicle.pitch.zero + vehicle.pitch.alpha_per_rad * x[0]) / vehicle.pitch.elevator_per_rad;
  x[7] = std::max(vehicle.throttle_of(pressure_n * vehicle.drag_coefficient(x[0]),
                                      flight.airspeed_mps, flight.density_kg_per_m3),
                  0.1);
  constexpr int kMostSteps = 100;
  constexpr double kStep = 1e-6, kLeast = 1e-11, kEnough = 1e-10;
  double left = 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    const Unknowns lack = lacking(vehicle, flight, x);
    left = lack.cwiseAbs().maxCoeff();
    if (!(left > kLeast)) break;
    Eigen::Matrix<double, 8, 8> slopes;
    for (int k = 0; k < 8; ++k) {
      const Unknowns aside = kStep * Unknowns::Unit(k);
      slopes.col(k) = (lacking(vehicle, flight, x + aside) - lacking(vehicle, flight, x - aside)) /
                      (2.0 * kStep);
    }
    const Unknowns change = slopes.fullPivLu().solve(-lack);
    constexpr double kMostChange = 0.2;  // rad, and of the throttle
    x += change * std::min(1.0, kMostChange / std::max(change.cwiseAbs().maxCoeff(), 1e-300));
  }
  if (!(left <= kEnough))
    core::fail(core::ErrorKind::Input,
               "there is no steady flight at {:.1f} m/s, climbing by {:.1f} deg and turning by "
               "{:.1f} deg/s: fly faster, or climb and turn less",
               flight.airspeed_mps, degrees_from_radians(flight.climb_rad),
               degrees_from_radians(flight.turn_radps));
  const Trim trim = trim_of(flight, x);
  check_limits(vehicle, trim);
  return trim;
}

Eigen::Matrix<double, 8, 8> linearised(const FixedWing& vehicle, const Trim& trim) {
  const auto rates_of = [&](const FlightState& state) {
    const Vector3d turn_rate = state.segment<3>(3);
    const Accelerations rates =
        accelerations_of(vehicle, trim.flight, attitude_of(state[6], state[7]), state.head<3>(),
                         turn_rate, trim.controls);
    // Euler's angles of forward, right, down.
    const double p = turn_rate.x(), q = -turn_rate.y(), r = -turn_rate.z();
    const double sin = std::sin(state[7]), cos = std::cos(state[7]);
    FlightState change;
    change << rates.velocity, rates.turn_rate, q * cos - r * sin,
        p + std::tan(state[6]) * (q * sin + r * cos);
    return change;
  };
  FlightState state;
  state << trim.velocity_body_mps, trim.turn_rate_body_radps, trim.pitch_rad(), trim.bank_rad();
  Eigen::Matrix<double, 8, 8> slopes;
  constexpr double kStep = 1e-4;
  for (int k = 0; k < 8; ++k) {
    const FlightState aside = kStep * FlightState::Unit(k);
    slopes.col(k) = (rates_of(state + aside) - rates_of(state - aside)) / (2.0 * kStep);
  }
  return slopes;
}

}  // namespace terracast::geo
