#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "core/schema.h"
#include "geo/air/flight_air.h"
#include "geo/trajectory.h"
#include "geo/vehicles/flown_steps.h"
#include "geo/vehicles/quadrotor.h"
#include "geo/vehicles/rigid_body.h"

/// Quadrotors that a controller flies along a planned motion, by forces: rotors with lag and limits, drag, wind.
namespace terracast::geo {

/// How quickly the controller acts.
struct FlightControl {
  double position_radps = 0.0;  ///< 0: a quarter of attitude_radps
  double attitude_radps = 0.0;  ///< 0: 0.35 over the rotors' longer lag, 12 at most

  void describe(core::SchemaVisitor& visit);
  /// With 0 replaced for a vehicle.
  FlightControl resolved(const Quadrotor& vehicle) const;
};

/// The equations of motion of a quadrotor under control: derivatives of a state by time. Threads: one at a time.
///
/// The rotors push T_i = k_F W_i^2 along the body's z axis at their places, and turn it by -k_M W_i^2 about z. Each has a
/// drag of -k_d W_i times the velocity of its hub against the air, across z, and the body one of -c |V| V. W_i follows what it
/// is told with a lag, and stays within its limits. Gravity is that of the place, and the Earth turns.
///
/// The controller (Lee, Leok and McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), CDC 2010; with an
/// integral of the error in place) knows the planned motion and the state, and nothing of the wind. Errors in place die away as
/// the poles (s + p)^2 (s + p/4), errors in attitude as (s + a)^2.
/// source   rotor drag: Faessler, Franchi and Scaramuzza, RA-L 2018
class QuadrotorDynamics {
 public:
  static constexpr int kMostStates = 40;
  using State = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostStates, 1>;
  /// Where states stand behind those of the rigid body. Its position counts from `anchor_world`.
  static constexpr int kPositionIntegral = rigid_state::kSize;  ///< of the error in place, m s
  static constexpr int kAirWay = kPositionIntegral + 3;  ///< as AirWay; its distance from time 0 on
  static constexpr int kRotors = kAirWay + 3;            ///< turn rates, rad/s

  /// plan   lives longer
  /// air    null: calm; lives longer
  /// throws Config: what the vehicle lacks (Quadrotor::validate_dynamics)
  QuadrotorDynamics(const WorldFrame& frame, const Quadrotor& vehicle, const FlightControl& control,
                    const Trajectory& plan, const FlightAir* air);

  /// The planned state at a time, with rotors that hold its thrust; the anchor goes there.
  State start(double time_s);
  State rates(double time_s, const State& state) const;
  /// What the rotors are told, rad/s, and whether one was to be faster or slower than it can be.
  struct Commands {
    Eigen::VectorXd rotors_radps;
    bool is_saturated;
  };
  Commands commands(double time_s, const State& state) const;
  bool is_saturated(double time_s, const State& state) const {
    return commands(time_s, state).is_saturated;
  }
  Eigen::Vector3d wind_world_mps(double time_s, const State& state) const;
  /// Forces by the air and the rotors, N, of the world, and moments, N m, of the body.
  std::pair<Eigen::Vector3d, Eigen::Vector3d> forces(double time_s, const State& state) const;

  const Eigen::Vector3d& anchor_world() const { return anchor_world_; }
  Eigen::Vector3d place_world(const State& state) const {
    return anchor_world_ + state.segment<3>(rigid_state::kPosition);
  }
  /// Moves the anchor to the state's place.
  void move_anchor(State& state);
  const MotionState& planned(double time_s) const;

 private:
  MetAir air_at(double time_s, const State& state) const;
  Commands commands(double time_s, const State& state, const Eigen::Vector3d& gravity) const;
  Eigen::VectorXd rotors_of(const State& state, const Commands& commands) const;
  std::pair<Eigen::Vector3d, Eigen::Vector3d> forces(const State& state,
                                                     const Eigen::VectorXd& rotors_radps,
                                                     const Eigen::Vector3d& wind_world_mps) const;
  bool has_lag() const { return vehicle_.rotor_lag_up_s > 0.0 || vehicle_.rotor_lag_down_s > 0.0; }

  WorldFrame frame_;
  Quadrotor vehicle_;
  FlightControl control_;
  const Trajectory& plan_;
  const FlightAir* air_;
  Eigen::Vector3d earth_rate_world_;
  Eigen::Vector3d inertia_kg_m2_, body_drag_;
  Eigen::MatrixXd wrench_from_thrusts_, thrusts_from_wrench_;
  Eigen::Vector3d anchor_world_ = Eigen::Vector3d::Zero();
  /// The planned states of the last times that were asked: two steps share each.
  mutable std::array<MotionState, 4> remembered_;
  mutable std::size_t next_remembered_ = 0;
};

/// A flight along a plan by QuadrotorDynamics, in steps of 1 ms, as a curve with nodes every 20 ms.
/// control         so quick that the flight, with the times before and after it, lasts kMostFlown_s at most
/// plan            asked from `settling_s` before its time 0 on, from where the flight begins in the planned state
/// max_off_m       from the planned place, from time 0 on
/// report          filled, also when it fails
/// accuracy        between nodes the curve is within 1e-6 m and 1e-6 rad of the steps (FlownQuadrotor.…)
/// cost            20 ms of work and 35 kB a second of flight
/// throws          Input: farther off its path than max_off_m, with time and place
std::unique_ptr<FlownMotion> fly(const WorldFrame& frame, const Trajectory& plan,
                                 const Quadrotor& vehicle, const FlightControl& control,
                                 const FlightAir* air, double max_off_m, FlightReport& report);

/// How long before its time 0 a flight begins: until errors of its beginning have died away.
double settling_s(const FlightControl& resolved);

}  // namespace terracast::geo
