#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>

#include "core/schema.h"
#include "geo/air/flight_air.h"
#include "geo/vehicles/flat_wing.h"
#include "geo/vehicles/flown_steps.h"

/// Fixed-wing aircraft that a controller flies along a planned path, by forces: control surfaces, propeller, wind.
namespace terracast::geo {

/// How quickly the controller acts.
struct WingControl {
  double position_radps = 0.8;
  double attitude_radps = 5.0;
  double wind_s = 2.0;

  void describe(core::SchemaVisitor& visit);
};

/// The equations of motion of a fixed-wing aircraft under control: derivatives of a state by time. Threads: one at a
/// time.
///
/// Forces are those of wing_forces() in the air at the aircraft's place, which is as dense as the standard atmosphere
/// there. Gravity is that of the place, and the Earth turns. Surfaces and propeller do at once what is set, within their limits.
///
/// The controller seeks the planned place at the planned time. It asks for the acceleration under which errors in place die
/// away as the poles (s + p)^2 (s + p/4), takes the attitude and thrust of coordinated flight for it
/// (CoordinatedFlight), and turns the aircraft there with errors that die away as (s + a)^2, by deflections that follow
/// from the moments of its own model (dynamic inversion). An aircraft without a rudder is not turned about its z axis. Of the wind
/// it knows an estimate that follows the wind with a lag.
/// source   Stevens, Lewis and Johnson, Aircraft Control and Simulation (3rd edition, 2015), section 5.8 (dynamic inversion)
class FixedWingDynamics {
 public:
  /// Where states stand behind those of the rigid body. Its position counts from `anchor_world`.
  static constexpr int kPositionIntegral = rigid_state::kSize;  ///< of the error in place, m s
  static constexpr int kAirWay = kPositionIntegral + 3;  ///< as AirWay; its distance from time 0 on
  static constexpr int kKnownWind = kAirWay + 3;         ///< of the world, m/s
  static constexpr int kStates = kKnownWind + 3;
  using State = Eigen::Matrix<double, kStates, 1>;

  /// plan   lives longer
  /// air    null: calm; lives longer
  FixedWingDynamics(const CoordinatedFlight& flight, const WingControl& control,
                    const Trajectory& plan, const FlightAir* air);

  /// The planned state at a time, in the mean wind; the anchor goes there.
  State start(double time_s);
  State rates(double time_s, const State& state) const;
  struct Commands {
    WingControls controls;
    bool is_saturated;  ///< more was asked for than deflections, throttle or the stall allow
  };
  Commands commands(double time_s, const State& state) const;
  bool is_saturated(double time_s, const State& state) const {
    return commands(time_s, state).is_saturated;
  }
  /// Forces by the air and the propeller.
  WingForces forces(double time_s, const State& state) const;

  const Eigen::Vector3d& anchor_world() const { return anchor_world_; }
  Eigen::Vector3d place_world(const State& state) const {
    return anchor_world_ + state.segment<3>(rigid_state::kPosition);
  }
  /// Moves the anchor to the state's place.
  void move_anchor(State& state);
  const MotionState& planned(double time_s) const;

 private:
  WingForces forces(const State& state, const WingControls& controls,
                    const Eigen::Vector3d& wind_world_mps) const;
  Airflow airflow(const State& state, const Eigen::Vector3d& wind_world_mps) const;
  MetAir air_at(double time_s, const State& state) const;

  CoordinatedFlight flight_;
  WingControl control_;
  const Trajectory& plan_;
  const FlightAir* air_;
  Eigen::Vector3d earth_rate_world_;
  Eigen::Matrix3d inertia_, per_inertia_;
  Eigen::Matrix2d surfaces_from_moments_;  ///< aileron and rudder from coefficients of roll and yaw
  Eigen::Vector3d anchor_world_ = Eigen::Vector3d::Zero();
  /// The planned states of the last times that were asked: two steps share each.
  mutable std::array<MotionState, 4> remembered_;
  mutable std::size_t next_remembered_ = 0;
};

/// A flight along a plan by FixedWingDynamics, which begins at its time 0 in the planned state.
/// max_off_m       from the planned place, from time 0 on
/// report          filled, also when it fails
/// accuracy        between nodes the curve is within 1e-6 m and 5e-6 rad of the steps (FlownWing.…)
/// cost            25 ms of work and 30 kB a second of flight
/// throws          Input: farther off its path than max_off_m, with time and place
std::unique_ptr<FlownMotion> fly(const CoordinatedFlight& flight, const Trajectory& plan,
                                 const WingControl& control, const FlightAir* air, double max_off_m,
                                 FlightReport& report);

}  // namespace terracast::geo
