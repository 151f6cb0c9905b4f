#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/schema.h"

/// Forces and moments of a fixed-wing aircraft, by its stability derivatives.
namespace terracast::geo {

/// Coefficients of the forces and the moment in the plane of symmetry, by angle of attack, pitch rate and elevator.
/// Rates count by the chord over twice the airspeed.
struct PitchCoefficients {
  double zero = 0.0;
  double alpha_per_rad = 0.0;
  double q_per_rad = 0.0;
  double elevator_per_rad = 0.0;

  void describe(core::SchemaVisitor& visit);
};

/// Coefficients of the drag. That of the lift is (C_L0 + C_Lalpha alpha)^2 / (pi e AR).
struct DragCoefficients {
  double parasitic = 0.0;
  double oswald = 0.9;  ///< e, the span efficiency
  double q_per_rad = 0.0;
  double elevator_per_rad = 0.0;

  void describe(core::SchemaVisitor& visit);
};

/// Coefficients of the side force and of the moments about x and z, by sideslip, roll and yaw rate, aileron and rudder.
/// Rates count by the span over twice the airspeed.
struct SideCoefficients {
  double zero = 0.0;
  double beta_per_rad = 0.0;
  double p_per_rad = 0.0;
  double r_per_rad = 0.0;
  double aileron_per_rad = 0.0;
  double rudder_per_rad = 0.0;

  void describe(core::SchemaVisitor& visit);
};

struct PropellerOptions {
  double area_m2 = 0.0;
  double coefficient = 1.0;
  double full_mps = 0.0;  ///< speed of the air behind it at full throttle

  void describe(core::SchemaVisitor& visit);
};

/// What a pilot sets. Positive deflections are those of the coefficients' source.
struct WingControls {
  double elevator_rad = 0.0;
  double aileron_rad = 0.0;
  double rudder_rad = 0.0;
  double throttle = 0.0;  ///< 0 to 1
};

/// The flow about an aircraft.
struct Airflow {
  Eigen::Vector3d through_air_body_mps;  ///< velocity against the air; x forward, y left, z up
  Eigen::Vector3d turn_rate_body_radps;  ///< against the air, which does not turn
  double density_kg_per_m3;

  double speed_mps() const { return through_air_body_mps.norm(); }
  /// Angle of attack: positive where the air comes from below.
  double alpha_rad() const;
  /// Sideslip: positive where the air comes from the right.
  double beta_rad() const;
};

/// Forces and moments about the centre of mass along the body's axes.
struct WingForces {
  Eigen::Vector3d force_body_n;
  Eigen::Vector3d moment_body_nm;
  double lift_n;    ///< across the airflow, in the plane of symmetry
  double drag_n;    ///< against x of the body turned by the angle of attack
  double thrust_n;  ///< along x of the body
};

/// The figures of a fixed-wing aircraft.
///
/// Lift goes from its slope to that of a flat plate, 2 sign(a) sin^2 a cos a, about the angle of stall; side force and
/// moments are linear. The propeller pushes rho S C ((k throttle)^2 - V^2) / 2, and brakes where that is negative.
/// source   Beard and McLain, Small Unmanned Aircraft (Princeton 2012), chapter 4. Signs of coefficients and angles are
///          those of the book (forward, right, down).
struct FixedWing {
  double mass_kg = 0.0;
  std::vector<double> inertia_kg_m2 = {};  ///< J_x, J_y, J_z
  double product_of_inertia_kg_m2 = 0.0;   ///< J_xz, of x forward and z down
  double wing_area_m2 = 0.0;
  double span_m = 0.0;
  double chord_m = 0.0;
  double stall_deg = 27.0;        ///< alpha_0
  double stall_sharpness = 50.0;  ///< M
  double max_deflection_deg = 30.0;
  PitchCoefficients lift, pitch;
  DragCoefficients drag;
  SideCoefficients side, roll, yaw;
  PropellerOptions propeller;

  void describe(core::SchemaVisitor& visit);
  /// throws Config: what no aircraft has, or what it lacks to be flown
  void validate() const;

  /// Along x forward, y left, z up.
  Eigen::Matrix3d inertia_body_kg_m2() const;
  /// Without the elevator's and the pitch rate's.
  double lift_coefficient(double alpha_rad) const;
  /// Parasitic, and that of the lift.
  double drag_coefficient(double alpha_rad) const;
  /// Angle of attack of the greatest lift_coefficient(), up to 90 degrees.
  double alpha_of_most_lift_rad() const;
  double thrust_n(double throttle, double airspeed_mps, double density_kg_per_m3) const;
  /// The throttle that gives a thrust; below 0 or above 1 where none does.
  double throttle_of(double thrust_n, double airspeed_mps, double density_kg_per_m3) const;
  bool has_rudder() const;
  /// C_nbeta - C_lbeta C_ndelta_a / C_ldelta_a: how the nose turns back from a sideslip while the ailerons hold the bank
  /// (lateral control departure parameter). Without a rudder and below 0, holding a bank ends in a spin.
  double lateral_departure_per_rad() const;
};

/// threads   safe
WingForces wing_forces(const FixedWing& vehicle, const Airflow& flow, const WingControls& controls);

}  // namespace terracast::geo
