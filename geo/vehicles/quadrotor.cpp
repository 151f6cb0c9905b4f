#include "geo/vehicles/quadrotor.h"

#include <Eigen/QR>
#include <algorithm>
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

void Rotor::describe(core::SchemaVisitor& visit) {
  visit.key("x_m", x_m, "Place forward of the centre of mass.", core::between(-100.0, 100.0));
  visit.key("y_m", y_m, "Place left of the centre of mass.", core::between(-100.0, 100.0));
  visit.key("spin", spin, "Sense in which it turns, seen from above: left is anticlockwise.",
            core::one_of({"left", "right"}));
}

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
  visit.key("inertia_kg_m2", inertia_kg_m2,
            "Moments of inertia about the body's x, y and z. Counts, as all that follows, in flown "
            "flights alone.",
            {.lowest = 1e-9, .highest = 1e6, .max_size = 3});
  visit.key("moment_nm_s2_per_rad2", moment_nm_s2_per_rad2,
            "Moment of a rotor about its axis by its squared turn rate, N m/(rad/s)^2.",
            core::between(0.0, 1.0));
  visit.list("rotors", rotors, "Places of the rotors, in the plane of the centre of mass.");
  visit.key("rotor_lag_up_s", rotor_lag_up_s,
            "Time constant with which a rotor speeds up towards its command; 0: none.",
            core::between(0.0, 1.0));
  visit.key("rotor_lag_down_s", rotor_lag_down_s, "The same for slowing down.",
            core::between(0.0, 1.0));
  visit.key("body_drag_n_s2_per_m2", body_drag_n_s2_per_m2,
            "Drag along the body's x, y and z by the speed along it times the whole speed; none "
            "given: 0.",
            {.lowest = 0.0, .highest = 1000.0, .max_size = 3});
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

void Quadrotor::validate_dynamics() const {
  using core::ErrorKind;
  using core::fail;
  const auto need = [](bool is_there, const char* what) {
    if (!is_there)
      fail(ErrorKind::Config,
           "mode = \"flown\" needs {} of the vehicle; the sets of configs/vehicles have it", what);
  };
  need(thrust_n_s2_per_rad2 > 0.0, "thrust_n_s2_per_rad2");
  need(moment_nm_s2_per_rad2 > 0.0, "moment_nm_s2_per_rad2");
  need(inertia_kg_m2.size() == 3, "inertia_kg_m2 = [x, y, z]");
  need(body_drag_n_s2_per_m2.empty() || body_drag_n_s2_per_m2.size() == 3,
       "body_drag_n_s2_per_m2 = [x, y, z], or none,");
  need(!rotors.empty(), "the places of its rotors, [[vehicle.rotors]],");
  constexpr std::int64_t kMostRotors = 16;
  if (num_rotors != static_cast<std::int64_t>(rotors.size()) || num_rotors > kMostRotors)
    fail(ErrorKind::Config,
         "{} rotors have places, and num_rotors = {}; both must agree, and be {} at most",
         rotors.size(), num_rotors, kMostRotors);
  // No body has a moment larger than the sum of the two others; sets in use pass that by a fifth.
  constexpr double kMostOfOthers = 2.0;
  const double most_kg_m2 = *std::max_element(inertia_kg_m2.begin(), inertia_kg_m2.end());
  const double sum_kg_m2 = inertia_kg_m2[0] + inertia_kg_m2[1] + inertia_kg_m2[2];
  if (most_kg_m2 > kMostOfOthers * (sum_kg_m2 - most_kg_m2))
    fail(ErrorKind::Config,
         "inertia_kg_m2 = [{}, {}, {}]: no body has a moment of inertia larger than the sum of "
         "the two others; check the units (kg m^2)",
         inertia_kg_m2[0], inertia_kg_m2[1], inertia_kg_m2[2]);
  const Eigen::MatrixXd wrench = wrench_from_thrusts();
  constexpr double kLeastOfLargest = 1e-6;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> rank(wrench);
  rank.setThreshold(kLeastOfLargest);
  if (rank.rank() < 4)
    fail(ErrorKind::Config,
         "the rotors cannot push and turn about x, y and z as they stand: four or more must not "
         "lie on one line, and some must spin left and some right");
}

Eigen::MatrixXd Quadrotor::wrench_from_thrusts() const {
  Eigen::MatrixXd wrench(4, static_cast<Eigen::Index>(rotors.size()));
  const double arm_m = moment_nm_s2_per_rad2 / thrust_n_s2_per_rad2;
  for (Eigen::Index i = 0; i < wrench.cols(); ++i) {
    const Rotor& rotor = rotors[static_cast<std::size_t>(i)];
    wrench.col(i) << 1.0, rotor.y_m, -rotor.x_m, -rotor.left() * arm_m;
  }
  return wrench;
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
