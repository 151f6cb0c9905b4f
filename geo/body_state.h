#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>

#include "geo/rigid3.h"

/// The position and attitude of a body at one time, and its motion about that time.
namespace terracast::geo {

/// Describes a motion about a time beyond a constant acceleration and a constant angular velocity. With t the time
/// from there, the body stands at
///
///     x + v t + a t^2 / 2 + p3 t^3 + p4 t^4 + p5 t^5
///     R exp(f) exp(s t),   f = (w - s) t + r2 t^2 + r3 t^3 + r4 t^4 + r5 t^5
///
/// with p of `position_world`, r of `turning_body`, s the spin, and exp of a vector the turn by its length about it.
/// All of them 0 leave x + v t + a t^2 / 2 and R exp(w t). Beyond `reach_s` the sums of p and of r go on along
/// their tangents.
struct MotionTerms {
  double reach_s = 0.0;  ///< the terms are for times so far away; 0: there are none
  /// Of t^3, t^4, t^5: m/s^3, m/s^4, m/s^5.
  std::array<Eigen::Vector3d, 3> position_world = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                                   Eigen::Vector3d::Zero()};
  /// Of t^2, …, t^5, along the axes that the body has at t = 0: rad/s^2, …, rad/s^5.
  std::array<Eigen::Vector3d, 4> turning_body = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                                 Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  /// A constant turning about an axis of the body itself, as that of a rotor on what carries it.
  Eigen::Vector3d spin_body_radps = Eigen::Vector3d::Zero();
  /// What the poses differ by from those of the motion, at most, within the reach.
  double error_m = 0.0;
  double error_rad = 0.0;

  bool operator==(const MotionTerms&) const = default;
  bool are_any() const { return reach_s > 0.0; }

  /// p3 t^3 + p4 t^4 + p5 t^5, m.
  Eigen::Vector3d position_after(double offset_s) const;
  /// Its derivative, m/s.
  Eigen::Vector3d velocity_after(double offset_s) const;
  /// r2 t^2 + … + r5 t^5, rad.
  Eigen::Vector3d turning_after(double offset_s) const;
  /// Upper bounds on the lengths of both for all times no farther than that.
  double most_position_m(double offset_s) const;
  double most_turning_rad(double offset_s) const;
};

/// The pose and motion of the body at one time.
struct BodyState {
  double time_s = 0.0;
  Rigid3d world_from_body;  ///< body: x forward, y left, z up
  Eigen::Vector3d velocity_world_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_world_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_body_radps = Eigen::Vector3d::Zero();
  MotionTerms terms = {};
  bool operator==(const BodyState&) const = default;

  /// The pose so much later, or earlier, as MotionTerms says; without terms x + v t + a t^2 / 2, and R exp(w t) with
  /// the turning in the body's frame.
  Rigid3d pose_after(double offset_s) const;
  /// Derivative of its place by the time.
  Eigen::Vector3d velocity_after(double offset_s) const;
};

/// A state of a trajectory, with all derivatives that sensors ask for.
struct MotionState : BodyState {
  Eigen::Vector3d jerk_world_mps3 = Eigen::Vector3d::Zero();
  /// Derivative of the components of the angular velocity.
  Eigen::Vector3d angular_acceleration_body_radps2 = Eigen::Vector3d::Zero();
};

/// Fits the terms by which a state follows a motion: by least squares at Chebyshev's points of the reach, of as few
/// powers as come within 1e-9 m and 1e-10 rad.
/// state     at offset 0; its pose and first derivatives are those of the motion
/// pose_at   world_from_body of the motion, for offsets within the reach
/// reach_s   above 0
/// spin_body_radps   turning that is to be constant; more than half a turn within the reach is without trouble there
/// accuracy   stated in the terms: twice what they err by at 25 times within the reach. Of a smooth motion it falls with
///            the sixth power of the reach; about a knot it is up to 0.013 reach^2 times the jump of the angular
///            acceleration, and 0.0075 reach^3 times that of the jerk (BodyStates.…)
MotionTerms fit_terms(const BodyState& state,
                      const std::function<Rigid3d(double offset_s)>& pose_at, double reach_s,
                      const Eigen::Vector3d& spin_body_radps = Eigen::Vector3d::Zero());

/// The turn by a vector's length about it.
Eigen::Quaterniond rotation_of(const Eigen::Vector3d& vector_rad);
/// The vector of a rotation, of length up to pi.
Eigen::Vector3d rotation_vector_of(Eigen::Quaterniond rotation);

}  // namespace terracast::geo
