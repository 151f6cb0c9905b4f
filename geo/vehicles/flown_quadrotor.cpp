#include "geo/vehicles/flown_quadrotor.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "geo/gravity.h"
#include "geo/paths/place.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;
using State = QuadrotorDynamics::State;

/// limit_text   "max_off_m = 2" or what else it was
[[noreturn]] void refuse(const WorldFrame& frame, const MotionState& planned, double off_m,
                         const std::string& limit_text, const FlightReport& report) {
  const std::string saturated =
      report.saturated_s > 0.0
          ? fmt::format("its rotors were at their limits for {:.2f} s, first at t = {:.1f} s",
                        report.saturated_s, report.first_saturated_s)
          : "its rotors kept within their limits";
  core::fail(
      core::ErrorKind::Input,
      "the quadrotor comes {:.2f} m off its path at t = {:.1f} s ({}), more than {}; {}; fly "
      "slower or in less wind, with stronger rotors, or allow more",
      off_m, planned.time_s,
      text_of(frame.geodetic_from_world(planned.world_from_body.translation)), limit_text,
      saturated);
}

}  // namespace

void FlightControl::describe(core::SchemaVisitor& visit) {
  const core::Constraint range = core::between(0.0, 1000.0);
  visit.key("position_radps", position_radps,
            "How quickly errors in place die away; 0: a quarter of attitude_radps.", range);
  visit.key("attitude_radps", attitude_radps,
            "How quickly errors in attitude die away; 0: 0.35 by the rotors' lag, 12 at most.",
            range);
}

FlightControl FlightControl::resolved(const Quadrotor& vehicle) const {
  constexpr double kMost_radps = 12.0, kByLag = 0.35, kByAttitude = 0.25;
  FlightControl control = *this;
  const double lag_s = std::max(vehicle.rotor_lag_up_s, vehicle.rotor_lag_down_s);
  if (control.attitude_radps == 0.0)
    control.attitude_radps = lag_s > 0.0 ? std::min(kMost_radps, kByLag / lag_s) : kMost_radps;
  if (control.position_radps == 0.0) control.position_radps = kByAttitude * control.attitude_radps;
  return control;
}

QuadrotorDynamics::QuadrotorDynamics(const WorldFrame& frame, const Quadrotor& vehicle,
                                     const FlightControl& control, const Trajectory& plan,
                                     const FlightAir* air)
    : frame_(frame),
      vehicle_(vehicle),
      control_(control.resolved(vehicle)),
      plan_(plan),
      air_(air),
      earth_rate_world_(earth_rate_world_radps(frame)) {
  vehicle.validate_dynamics();
  inertia_kg_m2_ = Eigen::Map<const Vector3d>(vehicle.inertia_kg_m2.data());
  body_drag_ = vehicle.body_drag_n_s2_per_m2.empty()
                   ? Vector3d::Zero().eval()
                   : Vector3d(Eigen::Map<const Vector3d>(vehicle.body_drag_n_s2_per_m2.data()));
  wrench_from_thrusts_ = vehicle.wrench_from_thrusts();
  thrusts_from_wrench_ = wrench_from_thrusts_.completeOrthogonalDecomposition().pseudoInverse();
  for (MotionState& state : remembered_) state.time_s = std::numeric_limits<double>::quiet_NaN();
}

const MotionState& QuadrotorDynamics::planned(double time_s) const {
  for (const MotionState& state : remembered_)
    if (state.time_s == time_s) return state;
  MotionState& state = remembered_[next_remembered_];
  next_remembered_ = (next_remembered_ + 1) % remembered_.size();
  state = plan_.at(time_s);
  return state;
}

State QuadrotorDynamics::start(double time_s) {
  const MotionState& plan = planned(time_s);
  anchor_world_ = plan.world_from_body.translation;
  State state = State::Zero(kRotors + static_cast<int>(vehicle_.rotors.size()));
  state.segment<3>(rigid_state::kVelocity) = plan.velocity_world_mps;
  set_rotation(state, plan.world_from_body.rotation);
  state.segment<3>(rigid_state::kTurnRate) =
      plan.angular_velocity_body_radps +
      plan.world_from_body.rotation.conjugate() * earth_rate_world_;
  state.tail(static_cast<Eigen::Index>(vehicle_.rotors.size())) =
      commands(time_s, state).rotors_radps;
  return state;
}

void QuadrotorDynamics::move_anchor(State& state) {
  anchor_world_ += state.segment<3>(rigid_state::kPosition);
  state.segment<3>(rigid_state::kPosition).setZero();
}

QuadrotorDynamics::Commands QuadrotorDynamics::commands(double time_s, const State& state) const {
  return commands(time_s, state, gravity_world_mps2(frame_, place_world(state)));
}

QuadrotorDynamics::Commands QuadrotorDynamics::commands(double time_s, const State& state,
                                                        const Vector3d& gravity) const {
  const MotionState& plan = planned(time_s);
  const Vector3d velocity = state.segment<3>(rigid_state::kVelocity);
  const Vector3d off = place_world(state) - plan.world_from_body.translation;
  const double p = control_.position_radps;
  const Vector3d drag_by_mass = vehicle_.drag_per_s() * plan.velocity_world_mps;
  // (s + p)^2 (s + p / 4)
  const Vector3d force_by_mass = plan.acceleration_world_mps2 - 1.5 * p * p * off -
                                 2.25 * p * (velocity - plan.velocity_world_mps) -
                                 0.25 * p * p * p * Vector3d(state.segment<3>(kPositionIntegral)) +
                                 2.0 * earth_rate_world_.cross(velocity) - gravity + drag_by_mass;
  const Eigen::Quaterniond rotation = rotation_in(state);
  const Vector3d planned_up = plan.world_from_body.rotation * Vector3d::UnitZ();
  constexpr double kLeast_mps2 = 0.5;  // a smaller force has no direction to speak of
  const Vector3d up = force_by_mass.norm() > kLeast_mps2 ? force_by_mass.normalized() : planned_up;
  // Drag has no part along z for which the thrust would have to make up.
  const double thrust_n =
      vehicle_.mass_kg * (force_by_mass - drag_by_mass).dot(rotation * Vector3d::UnitZ());
  const Eigen::Quaterniond wanted =
      Eigen::Quaterniond::FromTwoVectors(planned_up, up) * plan.world_from_body.rotation;
  const Eigen::Quaterniond error = wanted.conjugate() * rotation;
  const Vector3d turn_rate = state.segment<3>(rigid_state::kTurnRate);
  const Vector3d against_world = turn_rate - rotation.conjugate() * earth_rate_world_;
  const Vector3d wanted_rate = error.conjugate() * plan.angular_velocity_body_radps;
  const Vector3d wanted_change = error.conjugate() * plan.angular_acceleration_body_radps2;
  const double a = control_.attitude_radps;
  const Vector3d turning = -2.0 * a * a * error.w() * error.vec() -
                           2.0 * a * (against_world - wanted_rate) + wanted_change -
                           against_world.cross(wanted_rate);
  const Vector3d moment = inertia_kg_m2_.cwiseProduct(turning) +
                          turn_rate.cross(inertia_kg_m2_.cwiseProduct(turn_rate));
  Eigen::Vector4d wrench;
  wrench << thrust_n, moment;
  const Eigen::VectorXd thrusts_n = thrusts_from_wrench_ * wrench;
  const double most_radps = vehicle_.max_rotor_radps > 0.0
                                ? vehicle_.max_rotor_radps
                                : std::numeric_limits<double>::infinity();
  Commands commands{.rotors_radps = Eigen::VectorXd(thrusts_n.size()), .is_saturated = false};
  for (Eigen::Index i = 0; i < thrusts_n.size(); ++i) {
    const double rate = std::sqrt(std::max(thrusts_n[i], 0.0) / vehicle_.thrust_n_s2_per_rad2);
    commands.rotors_radps[i] = std::min(rate, most_radps);
    commands.is_saturated = commands.is_saturated || thrusts_n[i] < 0.0 || rate > most_radps;
  }
  return commands;
}

MetAir QuadrotorDynamics::air_at(double time_s, const State& state) const {
  return met_air(air_, frame_, time_s, place_world(state), state.segment<3>(rigid_state::kVelocity),
                 state.segment<3>(kAirWay));
}

Vector3d QuadrotorDynamics::wind_world_mps(double time_s, const State& state) const {
  return air_at(time_s, state).wind_world_mps;
}

Eigen::VectorXd QuadrotorDynamics::rotors_of(const State& state, const Commands& commands) const {
  if (!has_lag()) return commands.rotors_radps;
  return state.tail(commands.rotors_radps.size());
}

std::pair<Vector3d, Vector3d> QuadrotorDynamics::forces(double time_s, const State& state) const {
  return forces(state, rotors_of(state, commands(time_s, state)), wind_world_mps(time_s, state));
}

std::pair<Vector3d, Vector3d> QuadrotorDynamics::forces(const State& state,
                                                        const Eigen::VectorXd& rotors_radps,
                                                        const Vector3d& wind_world_mps) const {
  const Eigen::Quaterniond rotation = rotation_in(state);
  const Vector3d velocity = state.segment<3>(rigid_state::kVelocity);
  const Vector3d through_air = rotation.conjugate() * (velocity - wind_world_mps);
  const Vector3d turn_rate =
      Vector3d(state.segment<3>(rigid_state::kTurnRate)) - rotation.conjugate() * earth_rate_world_;
  const Eigen::VectorXd thrusts_n = vehicle_.thrust_n_s2_per_rad2 * rotors_radps.cwiseAbs2();
  const Eigen::Vector4d wrench = wrench_from_thrusts_ * thrusts_n;
  Vector3d force(0.0, 0.0, wrench[0]);
  Vector3d moment = wrench.tail<3>();
  for (std::size_t i = 0; i < vehicle_.rotors.size(); ++i) {
    const Vector3d hub(vehicle_.rotors[i].x_m, vehicle_.rotors[i].y_m, 0.0);
    Vector3d drag = -vehicle_.drag_n_s2_per_rad_m * rotors_radps[static_cast<Eigen::Index>(i)] *
                    (through_air + turn_rate.cross(hub));
    drag.z() = 0.0;
    force += drag;
    moment += hub.cross(drag);
  }
  force -= through_air.norm() * body_drag_.cwiseProduct(through_air);
  return {rotation * force, moment};
}

State QuadrotorDynamics::rates(double time_s, const State& state) const {
  const Vector3d gravity = gravity_world_mps2(frame_, place_world(state));
  const Commands told = commands(time_s, state, gravity);
  const MetAir air = air_at(time_s, state);
  const Eigen::VectorXd rotors_radps = rotors_of(state, told);
  const auto [force, moment] = forces(state, rotors_radps, air.wind_world_mps);
  const Vector3d velocity = state.segment<3>(rigid_state::kVelocity);
  State rates = State::Zero(state.size());
  set_rigid_rates(
      state, Vector3d(force / vehicle_.mass_kg + gravity - 2.0 * earth_rate_world_.cross(velocity)),
      moment, inertia_kg_m2_, earth_rate_world_, rates);
  rates.segment<3>(kPositionIntegral) =
      place_world(state) - planned(time_s).world_from_body.translation;
  rates.segment<3>(kAirWay) = air.way_rate;
  if (!has_lag()) return rates;
  for (Eigen::Index i = 0; i < told.rotors_radps.size(); ++i) {
    const double lacking = told.rotors_radps[i] - rotors_radps[i];
    const double lag_s = lacking > 0.0 ? vehicle_.rotor_lag_up_s : vehicle_.rotor_lag_down_s;
    rates[kRotors + i] = lacking / std::max(lag_s, kFlownStep_s);
  }
  return rates;
}

double settling_s(const FlightControl& resolved) { return 30.0 / resolved.position_radps; }

std::unique_ptr<FlownMotion> fly(const WorldFrame& frame, const Trajectory& plan,
                                 const Quadrotor& vehicle, const FlightControl& control,
                                 const FlightAir* air, double max_off_m, FlightReport& report) {
  QuadrotorDynamics dynamics(frame, vehicle, control, plan, air);
  constexpr double kMoreBefore = 10.0;  // when it begins, it does not lean against the wind yet
  return flown_along(frame, dynamics, settling_s(control.resolved(vehicle)), plan.duration_s(),
                     max_off_m, kMoreBefore, report,
                     [&](const MotionState& planned, double off_m, const std::string& limit_text) {
                       refuse(frame, planned, off_m, limit_text, report);
                     });
}

}  // namespace terracast::geo
