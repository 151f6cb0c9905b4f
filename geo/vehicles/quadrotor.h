#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/schema.h"
#include "geo/geodesy.h"
#include "geo/paths/changing.h"
#include "geo/paths/least_snap.h"

namespace terracast::geo {

/// A rotor in the plane of the body's centre of mass.
struct Rotor {
  double x_m = 0.0;  ///< forward of the centre of mass
  double y_m = 0.0;  ///< left of it
  std::string spin = "left";

  void describe(core::SchemaVisitor& visit);
  /// 1: to the left, anticlockwise from above, which turns the body to the right
  double left() const { return spin == "left" ? 1.0 : -1.0; }
};

/// The physical figures of a body that rotors carry, all of which push along its z axis.
struct Quadrotor {
  double mass_kg = 1.0;  ///< with its rotors
  std::int64_t num_rotors = 4;
  double thrust_n_s2_per_rad2 = 0.0;  ///< of a rotor, by its squared turn rate; 0: not known
  /// Force of a rotor across its axis, by its turn rate and the speed across; 0: none.
  double drag_n_s2_per_rad_m = 0.0;
  double max_rotor_radps = 0.0;  ///< 0: no limit
  // What flights with dynamics need beside that.
  std::vector<double> inertia_kg_m2 = {};  ///< about x, y, z, which are principal axes
  double moment_nm_s2_per_rad2 = 0.0;      ///< of a rotor about its axis, by its squared turn rate
  std::vector<Rotor> rotors = {};
  double rotor_lag_up_s =
      0.0;  ///< time in which a rotor comes to 1 - 1/e of what it is told; 0: none
  double rotor_lag_down_s = 0.0;
  std::vector<double> body_drag_n_s2_per_m2 = {};  ///< along x, y, z; empty: none

  void describe(core::SchemaVisitor& visit);
  /// throws Config: figures that need the thrust of a rotor, without it; a body that its rotors cannot carry
  void validate() const;
  /// throws Config: what its dynamics lack, or rotors that cannot turn the body about each of its axes
  void validate_dynamics() const;

  /// Deceleration across the body's z axis by the speed across it, 1/s, with the rotors as fast as they hover.
  double drag_per_s() const;
  /// Largest thrust by the mass, m/s^2; infinity without a limit.
  double max_thrust_mps2() const;
  /// The thrust of all rotors, and the moments about x, y and z, from the thrust of each: N and N m.
  Eigen::MatrixXd wrench_from_thrusts() const;
};

/// The thrust of a body that flies a motion, in still air, by its mass, without its size: a + 2 W x v - g + d v, with g the gravity of the place, W the Earth's turning and
/// d the drag. The last term makes up for drag, -d times the velocity across the thrust, so that the
/// direction is exact and the length is larger than the thrust's by d times the velocity along it.
/// source   Faessler, Franchi and Scaramuzza, Differential flatness of quadrotor dynamics subject to rotor drag (RA-L
///          2018), with equal drag along x and y
Changing thrust_along(const WorldFrame& frame, const LeastSnapCurve::Value& motion,
                      double drag_per_s);

/// The attitude in which a body flies a motion exactly: its z axis along the thrust, its x axis in the vertical plane
/// of the heading.
/// heading   any vector that is neither vertical nor nought; its horizontal direction counts
Turning flat_turning(const WorldFrame& frame, const LeastSnapCurve::Value& motion,
                     const Changing& heading, double drag_per_s);

}  // namespace terracast::geo
