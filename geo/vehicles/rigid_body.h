#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

/// The motion of a rigid body as a vector that is integrated over time.
namespace terracast::geo {

/// Where the parts of a rigid body's motion stand in a state vector; further states follow.
namespace rigid_state {
inline constexpr int kPosition = 0;   ///< of the world, m
inline constexpr int kVelocity = 3;   ///< against the Earth, of the world, m/s
inline constexpr int kRotation = 6;   ///< world_from_body: w x y z
inline constexpr int kTurnRate = 10;  ///< against the stars, of the body, rad/s
inline constexpr int kSize = 13;
}  // namespace rigid_state

template <class State>
Eigen::Quaterniond rotation_in(const State& state) {
  return {state[rigid_state::kRotation], state[rigid_state::kRotation + 1],
          state[rigid_state::kRotation + 2], state[rigid_state::kRotation + 3]};
}

template <class State>
void set_rotation(State& state, const Eigen::Quaterniond& rotation) {
  state.template segment<4>(rigid_state::kRotation) << rotation.w(), rotation.x(), rotation.y(),
      rotation.z();
}

/// Derivatives of a rigid body's motion by time: Newton's and Euler's equations.
/// acceleration_world_mps2   against the Earth, all forces of its turning included
/// moment_body_nm            about the centre of mass
/// inertia_kg_m2             about the body's axes, which are its principal ones
/// earth_rate_world_radps    of the world against the stars
template <class State>
void set_rigid_rates(const State& state, const Eigen::Vector3d& acceleration_world_mps2,
                     const Eigen::Vector3d& moment_body_nm, const Eigen::Vector3d& inertia_kg_m2,
                     const Eigen::Vector3d& earth_rate_world_radps, State& rates) {
  const Eigen::Quaterniond rotation = rotation_in(state);
  const Eigen::Vector3d turn_rate = state.template segment<3>(rigid_state::kTurnRate);
  const Eigen::Vector3d against_world = turn_rate - rotation.conjugate() * earth_rate_world_radps;
  const Eigen::Quaterniond change =
      rotation * Eigen::Quaterniond(0.0, 0.5 * against_world.x(), 0.5 * against_world.y(),
                                    0.5 * against_world.z());
  rates.template segment<3>(rigid_state::kPosition) =
      state.template segment<3>(rigid_state::kVelocity);
  rates.template segment<3>(rigid_state::kVelocity) = acceleration_world_mps2;
  set_rotation(rates, change);
  const Eigen::Vector3d momentum = inertia_kg_m2.cwiseProduct(turn_rate);
  rates.template segment<3>(rigid_state::kTurnRate) =
      (moment_body_nm - turn_rate.cross(momentum)).cwiseQuotient(inertia_kg_m2);
}

/// The same for a body whose axes are not its principal ones.
/// inertia_kg_m2, per_inertia   about the body's axes, and its inverse
template <class State>
void set_rigid_rates(const State& state, const Eigen::Vector3d& acceleration_world_mps2,
                     const Eigen::Vector3d& moment_body_nm, const Eigen::Matrix3d& inertia_kg_m2,
                     const Eigen::Matrix3d& per_inertia,
                     const Eigen::Vector3d& earth_rate_world_radps, State& rates) {
  set_rigid_rates(state, acceleration_world_mps2, Eigen::Vector3d::Zero().eval(),
                  Eigen::Vector3d::Ones().eval(), earth_rate_world_radps, rates);
  const Eigen::Vector3d turn_rate = state.template segment<3>(rigid_state::kTurnRate);
  rates.template segment<3>(rigid_state::kTurnRate) =
      per_inertia *
      Eigen::Vector3d(moment_body_nm - turn_rate.cross(Eigen::Vector3d(inertia_kg_m2 * turn_rate)));
}

/// A step of the classical method of Runge and Kutta of the fourth order; the rotation comes back to length 1.
/// rates   rates(time_s, state): its derivative by time
template <class State, class Rates>
State runge_kutta_step(const State& state, double time_s, double step_s, const Rates& rates) {
  const State first = rates(time_s, state);
  const State second = rates(time_s + 0.5 * step_s, State(state + 0.5 * step_s * first));
  const State third = rates(time_s + 0.5 * step_s, State(state + 0.5 * step_s * second));
  const State fourth = rates(time_s + step_s, State(state + step_s * third));
  State next = state + step_s / 6.0 * (first + 2.0 * second + 2.0 * third + fourth);
  next.template segment<4>(rigid_state::kRotation).normalize();
  return next;
}

}  // namespace terracast::geo
