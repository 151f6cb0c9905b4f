#include "geo/vehicles/quadrotor.h"

#include <cmath>
#include <limits>

#include "core/error.h"
#include "geo/gravity.h"
#include "geo/paths/attitude.h"

namespace terracast::geo {
namespace {

/// Gravity along a motion, with its derivatives by time. Its derivatives by place are central differences over 2 km, of which the
/// next term is 1e-7 of them: 1e-12 m/s^3 at 10 m/s.
Changing gravity_along(const WorldFrame& frame, const LeastSnapCurve::Value& motion) {
  constexpr double kStep_m = 1000.0;
  const Eigen::Vector3d here = gravity_world_mps2(frame, motion.position);
  const auto first_along =
      [&](const Eigen::Vector3d& vector) -> std::pair<Eigen::Vector3d, Eigen::Vector3d> {
    const double length = vector.norm();
    if (length == 0.0) return {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    const Eigen::Vector3d step = kStep_m / length * vector;
    const Eigen::Vector3d before = gravity_world_mps2(frame, motion.position - step);
    const Eigen::Vector3d after = gravity_world_mps2(frame, motion.position + step);
    const double per_step = length / kStep_m;
    return {0.5 * per_step * (after - before), per_step * per_step * (after - 2.0 * here + before)};
  };
  const auto [rate, second] = first_along(motion.velocity);
  return {here, rate, second + first_along(motion.acceleration).first};
}

}  // namespace

void Quadrotor::describe(core::SchemaVisitor& visit) {
  visit.key("mass_kg", mass_kg, "Mass of the body with its rotors.", core::between(0.001, 1000.0));
  visit.key("num_rotors", num_rotors, "Rotors, all of which push along the body's z axis.",
            core::between(1.0, 100.0));
  visit.key("thrust_n_s2_per_rad2", thrust_n_s2_per_rad2,
            "Thrust of a rotor by its squared turn rate, N/(rad/s)^2; 0: not known.",
            core::between(0.0, 1.0));
  visit.key("drag_n_s2_per_rad_m", drag_n_s2_per_rad_m,
            "Drag of a rotor across its axis, by its turn rate (that of hovering) and its speed "
            "across, N/(rad/s)/(m/s); 0: none.",
            core::between(0.0, 1.0));
  visit.key("max_rotor_radps", max_rotor_radps, "Fastest turn rate of a rotor; 0: no limit.",
            core::between(0.0, 100000.0));
}

void Quadrotor::validate() const {
  if (thrust_n_s2_per_rad2 == 0.0 && (drag_n_s2_per_rad_m > 0.0 || max_rotor_radps > 0.0)) {
    core::fail(core::ErrorKind::Config,
               "{} needs thrust_n_s2_per_rad2, from which the turn rate of a rotor follows",
               drag_n_s2_per_rad_m > 0.0 ? "drag_n_s2_per_rad_m" : "max_rotor_radps");
  }
  if (max_thrust_mps2() <= kGravity_mps2) {
    core::fail(core::ErrorKind::Config,
               "{} rotors of {} N s^2/rad^2 at {} rad/s lift {:.4g} kg, and mass_kg is {}: check "
               "the units (N/(rad/s)^2, not N/rpm^2)",
               num_rotors, thrust_n_s2_per_rad2, max_rotor_radps,
               max_thrust_mps2() * mass_kg / kGravity_mps2, mass_kg);
  }
}

double Quadrotor::drag_per_s() const {
  if (drag_n_s2_per_rad_m == 0.0) return 0.0;
  const double rotors = static_cast<double>(num_rotors);
  const double hovering_radps =
      std::sqrt(mass_kg * kGravity_mps2 / (rotors * thrust_n_s2_per_rad2));
  return rotors * drag_n_s2_per_rad_m * hovering_radps / mass_kg;
}

double Quadrotor::max_thrust_mps2() const {
  if (max_rotor_radps == 0.0) return std::numeric_limits<double>::infinity();
  return static_cast<double>(num_rotors) * thrust_n_s2_per_rad2 * max_rotor_radps *
         max_rotor_radps / mass_kg;
}

Changing thrust_along(const WorldFrame& frame, const LeastSnapCurve::Value& motion,
                      double drag_per_s) {
  const Eigen::Vector3d turning = 2.0 * earth_rate_world_radps(frame);
  const Changing gravity = gravity_along(frame, motion);
  return {motion.acceleration + turning.cross(motion.velocity) - gravity.value +
              drag_per_s * motion.velocity,
          motion.jerk + turning.cross(motion.acceleration) - gravity.rate +
              drag_per_s * motion.acceleration,
          motion.snap + turning.cross(motion.jerk) - gravity.second + drag_per_s * motion.jerk};
}

Turning flat_turning(const WorldFrame& frame, const LeastSnapCurve::Value& motion,
                     const Changing& heading, double drag_per_s) {
  const Changing up = up_along(frame, motion.position, motion.velocity, motion.acceleration);
  const Changing body_up = normalised(thrust_along(frame, motion, drag_per_s));
  const Changing forward = normalised(crossed(crossed(up, heading), body_up));
  return turning_of(forward, crossed(body_up, forward), body_up);
}

}  // namespace terracast::geo
