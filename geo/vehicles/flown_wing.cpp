#include "geo/vehicles/flown_wing.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "geo/gravity.h"
#include "geo/paths/place.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;
using WingState = FixedWingDynamics::State;

[[noreturn]] void refuse_off(const WorldFrame& frame, const MotionState& planned, double off_m,
                             const std::string& limit_text, const FlightReport& report) {
  const std::string saturated =
      report.saturated_s > 0.0
          ? fmt::format("its controls were at their limits for {:.2f} s, first at t = {:.1f} s",
                        report.saturated_s, report.first_saturated_s)
          : "its controls kept within their limits";
  core::fail(core::ErrorKind::Input,
             "the aircraft comes {:.2f} m off its path at t = {:.1f} s ({}), more than {}; {}; fly "
             "in less wind, in wider turns, at another speed, or allow more",
             off_m, planned.time_s,
             text_of(frame.geodetic_from_world(planned.world_from_body.translation)), limit_text,
             saturated);
}

}  // namespace

void WingControl::describe(core::SchemaVisitor& visit) {
  visit.key("position_radps", position_radps, "How quickly errors in place die away.",
            core::between(0.01, 100.0));
  visit.key("attitude_radps", attitude_radps, "How quickly errors in attitude die away.",
            core::between(0.01, 100.0));
  visit.key("wind_s", wind_s, "Time constant with which the controller learns of a change of wind.",
            core::between(0.01, 1000.0));
}

FixedWingDynamics::FixedWingDynamics(const CoordinatedFlight& flight, const WingControl& control,
                                     const Trajectory& plan, const FlightAir* air)
    : flight_(flight),
      control_(control),
      plan_(plan),
      air_(air),
      earth_rate_world_(earth_rate_world_radps(flight.frame())),
      inertia_(flight.vehicle().inertia_body_kg_m2()),
      per_inertia_(inertia_.inverse()) {
  const FixedWing& vehicle = flight_.vehicle();
  if (vehicle.has_rudder()) {
    Eigen::Matrix2d moments;
    moments << vehicle.roll.aileron_per_rad, vehicle.roll.rudder_per_rad,
        vehicle.yaw.aileron_per_rad, vehicle.yaw.rudder_per_rad;
    surfaces_from_moments_ = moments.inverse();
  } else {
    surfaces_from_moments_ << 1.0 / vehicle.roll.aileron_per_rad, 0.0, 0.0, 0.0;
  }
  for (MotionState& state : remembered_) state.time_s = std::numeric_limits<double>::quiet_NaN();
}

const MotionState& FixedWingDynamics::planned(double time_s) const {
  for (const MotionState& state : remembered_)
    if (state.time_s == time_s) return state;
  MotionState& state = remembered_[next_remembered_];
  next_remembered_ = (next_remembered_ + 1) % remembered_.size();
  state = plan_.at(time_s);
  return state;
}

WingState FixedWingDynamics::start(double time_s) {
  const MotionState& plan = planned(time_s);
  anchor_world_ = plan.world_from_body.translation;
  State state = State::Zero();
  state.segment<3>(rigid_state::kVelocity) = plan.velocity_world_mps;
  set_rotation(state, plan.world_from_body.rotation);
  state.segment<3>(rigid_state::kTurnRate) =
      plan.angular_velocity_body_radps +
      plan.world_from_body.rotation.conjugate() * earth_rate_world_;
  if (air_)
    state.segment<3>(kKnownWind) =
        air_->wind.mean_mps(air_->place_in_air(flight_.frame(), time_s, anchor_world_));
  return state;
}

void FixedWingDynamics::move_anchor(State& state) {
  anchor_world_ += state.segment<3>(rigid_state::kPosition);
  state.segment<3>(rigid_state::kPosition).setZero();
}

MetAir FixedWingDynamics::air_at(double time_s, const State& state) const {
  return met_air(air_, flight_.frame(), time_s, place_world(state),
                 state.segment<3>(rigid_state::kVelocity), state.segment<3>(kAirWay));
}

Airflow FixedWingDynamics::airflow(const State& state, const Vector3d& wind_world_mps) const {
  const Eigen::Quaterniond body_from_world = rotation_in(state).conjugate();
  return {.through_air_body_mps =
              body_from_world * Vector3d(state.segment<3>(rigid_state::kVelocity) - wind_world_mps),
          .turn_rate_body_radps = Vector3d(state.segment<3>(rigid_state::kTurnRate)) -
                                  body_from_world * earth_rate_world_,
          .density_kg_per_m3 = density_at_kg_per_m3(flight_.frame(), place_world(state))};
}

FixedWingDynamics::Commands FixedWingDynamics::commands(double time_s, const State& state) const {
  const FixedWing& vehicle = flight_.vehicle();
  const MotionState& plan = planned(time_s);
  const Vector3d velocity = state.segment<3>(rigid_state::kVelocity);
  const Vector3d place = place_world(state);
  const Vector3d known_wind = state.segment<3>(kKnownWind);
  const double p = control_.position_radps, a = control_.attitude_radps;
  // (s + p)^2 (s + p / 4)
  const Vector3d acceleration = plan.acceleration_world_mps2 -
                                1.5 * p * p * (place - plan.world_from_body.translation) -
                                2.25 * p * (velocity - plan.velocity_world_mps) -
                                0.25 * p * p * p * Vector3d(state.segment<3>(kPositionIntegral));
  std::optional<WingPose> pose =
      flight_.pose(place, velocity, acceleration, known_wind, Vector3d::Zero());
  Commands commands{.controls = {}, .is_saturated = !pose};
  // It would stall: what the plan has must do.
  if (!pose)
    pose =
        flight_.pose(place, velocity, plan.acceleration_world_mps2, known_wind, Vector3d::Zero());
  const Eigen::Quaterniond sought = pose ? pose->world_from_body : plan.world_from_body.rotation;
  const auto limited = [&](double value, double least, double most) {
    commands.is_saturated = commands.is_saturated || !(value >= least && value <= most);
    return std::clamp(value, least, most);
  };
  commands.controls.throttle = limited(pose ? pose->throttle : 1.0, 0.0, 1.0);
  const Eigen::Quaterniond rotation = rotation_in(state);
  const Eigen::Quaterniond error = sought.conjugate() * rotation;
  const Airflow flow = airflow(state, known_wind);
  const Vector3d turn_rate = state.segment<3>(rigid_state::kTurnRate);
  const Vector3d& against_world = flow.turn_rate_body_radps;
  const Vector3d sought_rate = error.conjugate() * plan.angular_velocity_body_radps;
  const Vector3d sought_change = error.conjugate() * plan.angular_acceleration_body_radps2;
  const Vector3d turning = -2.0 * a * a * error.w() * error.vec() -
                           2.0 * a * (against_world - sought_rate) + sought_change -
                           against_world.cross(sought_rate);
  const Vector3d lacking = inertia_ * turning + turn_rate.cross(inertia_ * turn_rate) -
                           wing_forces(vehicle, flow, commands.controls).moment_body_nm;
  const double speed_mps = std::max(flow.speed_mps(), 1.0);
  const double pressure_n =
      0.5 * flow.density_kg_per_m3 * speed_mps * speed_mps * vehicle.wing_area_m2;
  const double most_rad = radians_from_degrees(vehicle.max_deflection_deg);
  commands.controls.elevator_rad =
      limited(-lacking.y() / (pressure_n * vehicle.chord_m * vehicle.pitch.elevator_per_rad),
              -most_rad, most_rad);
  const Eigen::Vector2d surfaces = surfaces_from_moments_ *
                                   Eigen::Vector2d(lacking.x(), -lacking.z()) /
                                   (pressure_n * vehicle.span_m);
  commands.controls.aileron_rad = limited(surfaces[0], -most_rad, most_rad);
  commands.controls.rudder_rad = limited(surfaces[1], -most_rad, most_rad);
  return commands;
}

WingForces FixedWingDynamics::forces(const State& state, const WingControls& controls,
                                     const Vector3d& wind_world_mps) const {
  return wing_forces(flight_.vehicle(), airflow(state, wind_world_mps), controls);
}

WingForces FixedWingDynamics::forces(double time_s, const State& state) const {
  return forces(state, commands(time_s, state).controls, air_at(time_s, state).wind_world_mps);
}

WingState FixedWingDynamics::rates(double time_s, const State& state) const {
  const Commands set = commands(time_s, state);
  const MetAir air = air_at(time_s, state);
  const WingForces acting = forces(state, set.controls, air.wind_world_mps);
  const Vector3d velocity = state.segment<3>(rigid_state::kVelocity);
  State rates = State::Zero();
  set_rigid_rates(state,
                  Vector3d(rotation_in(state) * acting.force_body_n / flight_.vehicle().mass_kg +
                           gravity_world_mps2(flight_.frame(), place_world(state)) -
                           2.0 * earth_rate_world_.cross(velocity)),
                  acting.moment_body_nm, inertia_, per_inertia_, earth_rate_world_, rates);
  // What cannot be done is not asked for ever more.
  if (!set.is_saturated)
    rates.segment<3>(kPositionIntegral) =
        place_world(state) - planned(time_s).world_from_body.translation;
  rates.segment<3>(kAirWay) = air.way_rate;
  rates.segment<3>(kKnownWind) =
      (air.wind_world_mps - Vector3d(state.segment<3>(kKnownWind))) / control_.wind_s;
  return rates;
}

std::unique_ptr<FlownMotion> fly(const CoordinatedFlight& flight, const Trajectory& plan,
                                 const WingControl& control, const FlightAir* air, double max_off_m,
                                 FlightReport& report) {
  FixedWingDynamics dynamics(flight, control, plan, air);
  return flown_along(flight.frame(), dynamics, 0.0, plan.duration_s(), max_off_m, 1.0, report,
                     [&](const MotionState& planned, double off_m, const std::string& limit_text) {
                       refuse_off(flight.frame(), planned, off_m, limit_text, report);
                     });
}

}  // namespace terracast::geo
