#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geo/vehicles/fixed_wing.h"

/// Steady flight of a fixed-wing aircraft over a flat Earth that does not turn, in still air.
namespace terracast::geo {

struct SteadyFlight {
  double airspeed_mps;
  double climb_rad = 0.0;   ///< of the path
  double turn_radps = 0.0;  ///< about up: positive to the left
  double density_kg_per_m3 = 1.225;
  double gravity_mps2 = 9.80665;
};

/// An aircraft in steady flight towards x, with z up.
struct Trim {
  SteadyFlight flight;
  Eigen::Quaterniond world_from_body;
  Eigen::Vector3d velocity_body_mps;
  Eigen::Vector3d turn_rate_body_radps;
  WingControls controls;

  double alpha_rad() const;
  double beta_rad() const;
  /// Of the body about its x axis: positive with the right wing down.
  double bank_rad() const;
  /// Nose up.
  double pitch_rad() const;
};

/// The attitude and controls in which nothing accelerates, by Newton's method. An aircraft with a rudder flies without
/// a side force, one without a rudder as it likes to.
/// accuracy   accelerations of 1e-10 m/s^2 and 1e-10 rad/s^2
/// throws     Input: there is none, or none within the deflections and the throttle
Trim trimmed(const FixedWing& vehicle, const SteadyFlight& flight);

/// Derivative by time of the state (velocity along the body, turn rate, pitch, bank) about a trim, by the state:
/// 8 by 8, with controls held.
/// accuracy   1e-7 of its largest element (central differences)
Eigen::Matrix<double, 8, 8> linearised(const FixedWing& vehicle, const Trim& trim);

}  // namespace terracast::geo
