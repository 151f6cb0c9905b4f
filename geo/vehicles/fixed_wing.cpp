#include "geo/vehicles/fixed_wing.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

double logistic(double x) { return 1.0 / (1.0 + std::exp(-x)); }

/// The share of a flat plate in the lift: 0 between the angles of stall, 1 beyond.
double stalled_share(const FixedWing& vehicle, double alpha_rad) {
  const double stall_rad = radians_from_degrees(vehicle.stall_deg);
  return 1.0 - logistic(-vehicle.stall_sharpness * (alpha_rad - stall_rad)) *
                   logistic(vehicle.stall_sharpness * (alpha_rad + stall_rad));
}

core::Constraint coefficient() { return core::between(-1000.0, 1000.0); }

}  // namespace

void PitchCoefficients::describe(core::SchemaVisitor& visit) {
  visit.key("zero", zero, "At an angle of attack of 0.", coefficient());
  visit.key("alpha_per_rad", alpha_per_rad, "By the angle of attack.", coefficient());
  visit.key("q_per_rad", q_per_rad, "By the pitch rate times chord / (2 airspeed).", coefficient());
  visit.key("elevator_per_rad", elevator_per_rad, "By the elevator's deflection.", coefficient());
}

void DragCoefficients::describe(core::SchemaVisitor& visit) {
  visit.key("parasitic", parasitic, "Drag without lift.", core::between(0.0, 10.0));
  visit.key("oswald", oswald, "Span efficiency e: lift drags by C_L^2 / (pi e AR).",
            core::between(0.1, 1.5));
  visit.key("q_per_rad", q_per_rad, "By the pitch rate times chord / (2 airspeed).", coefficient());
  visit.key("elevator_per_rad", elevator_per_rad, "By the elevator's deflection.", coefficient());
}

void SideCoefficients::describe(core::SchemaVisitor& visit) {
  visit.key("zero", zero, "Without sideslip.", coefficient());
  visit.key("beta_per_rad", beta_per_rad, "By the sideslip.", coefficient());
  visit.key("p_per_rad", p_per_rad, "By the roll rate times span / (2 airspeed).", coefficient());
  visit.key("r_per_rad", r_per_rad, "By the yaw rate times span / (2 airspeed).", coefficient());
  visit.key("aileron_per_rad", aileron_per_rad, "By the ailerons' deflection.", coefficient());
  visit.key("rudder_per_rad", rudder_per_rad, "By the rudder's deflection.", coefficient());
}

void PropellerOptions::describe(core::SchemaVisitor& visit) {
  visit.key("area_m2", area_m2, "Area that it sweeps.", core::between(0.0, 1000.0));
  visit.key("coefficient", coefficient, "Factor of its thrust.", core::between(0.0, 10.0));
  visit.key("full_mps", full_mps, "Speed of the air behind it at full throttle.",
            core::between(0.0, 1000.0));
}

void FixedWing::describe(core::SchemaVisitor& visit) {
  visit.key("mass_kg", mass_kg, "Mass.", core::between(0.001, 1e6));
  visit.key("inertia_kg_m2", inertia_kg_m2,
            "Moments of inertia about x (forward), y (right) and z (down).",
            {.lowest = 1e-9, .highest = 1e9, .max_size = 3});
  visit.key("product_of_inertia_kg_m2", product_of_inertia_kg_m2,
            "Product of inertia of x and z, J_xz.", core::between(-1e9, 1e9));
  visit.key("wing_area_m2", wing_area_m2, "Area of the wing.", core::between(1e-4, 1e4));
  visit.key("span_m", span_m, "Span of the wing.", core::between(0.01, 1000.0));
  visit.key("chord_m", chord_m, "Mean chord of the wing.", core::between(0.001, 100.0));
  visit.key("stall_deg", stall_deg, "Angle of attack about which the lift becomes a flat plate's.",
            core::between(1.0, 80.0));
  visit.key("stall_sharpness", stall_sharpness, "How abruptly it does, M of the book.",
            core::between(1.0, 1000.0));
  visit.key("max_deflection_deg", max_deflection_deg,
            "Largest deflection of elevator, ailerons and rudder.", core::between(0.1, 90.0));
  visit.section("lift", lift, "Coefficients of the lift.");
  visit.section("drag", drag, "Coefficients of the drag.");
  visit.section("pitch", pitch, "Coefficients of the pitching moment (nose up).");
  visit.section("side", side, "Coefficients of the side force (to the right).");
  visit.section("roll", roll, "Coefficients of the rolling moment (right wing down).");
  visit.section("yaw", yaw, "Coefficients of the yawing moment (nose to the right).");
  visit.section("propeller", propeller, "The propeller.");
}

void FixedWing::validate() const {
  const auto need = [](bool is_there, const char* what) {
    if (!is_there)
      core::fail(core::ErrorKind::Config,
                 "an aircraft needs {}; the sets of configs/vehicles/aerosonde_beard_mclain.toml "
                 "and zagi_beard_mclain.toml have it",
                 what);
  };
  need(mass_kg > 0.0, "mass_kg");
  need(inertia_kg_m2.size() == 3, "inertia_kg_m2 = [J_x, J_y, J_z]");
  need(wing_area_m2 > 0.0, "wing_area_m2");
  need(span_m > 0.0, "span_m");
  need(chord_m > 0.0, "chord_m");
  need(lift.alpha_per_rad > 0.0, "lift.alpha_per_rad above 0");
  need(drag.parasitic > 0.0, "drag.parasitic above 0");
  need(pitch.elevator_per_rad != 0.0, "pitch.elevator_per_rad");
  need(roll.aileron_per_rad != 0.0, "roll.aileron_per_rad");
  need(propeller.area_m2 > 0.0 && propeller.coefficient > 0.0 && propeller.full_mps > 0.0,
       "propeller.area_m2, propeller.coefficient and propeller.full_mps");
  // No body has a moment of inertia larger than the sum of the two others; rounded figures pass that by little.
  constexpr double kMostOfOthers = 1.1;
  const double sum = inertia_kg_m2[0] + inertia_kg_m2[1] + inertia_kg_m2[2];
  const double most = *std::max_element(inertia_kg_m2.begin(), inertia_kg_m2.end());
  if (most > kMostOfOthers * (sum - most) ||
      product_of_inertia_kg_m2 * product_of_inertia_kg_m2 >= inertia_kg_m2[0] * inertia_kg_m2[2])
    core::fail(core::ErrorKind::Config,
               "inertia_kg_m2 = [{}, {}, {}] with product_of_inertia_kg_m2 = {} is that of no "
               "body; check the units (kg m^2)",
               inertia_kg_m2[0], inertia_kg_m2[1], inertia_kg_m2[2], product_of_inertia_kg_m2);
  if (lift_coefficient(alpha_of_most_lift_rad()) <= 0.0)
    core::fail(core::ErrorKind::Config, "no angle of attack below the stall has lift; check lift");
}

Eigen::Matrix3d FixedWing::inertia_body_kg_m2() const {
  Eigen::Matrix3d inertia =
      Eigen::Vector3d(inertia_kg_m2[0], inertia_kg_m2[1], inertia_kg_m2[2]).asDiagonal();
  // -J_xz with z down; z up turns its sign.
  inertia(0, 2) = inertia(2, 0) = product_of_inertia_kg_m2;
  return inertia;
}

double FixedWing::lift_coefficient(double alpha_rad) const {
  const double stalled = stalled_share(*this, alpha_rad);
  const double sin = std::sin(alpha_rad);
  return (1.0 - stalled) * (lift.zero + lift.alpha_per_rad * alpha_rad) +
         stalled * 2.0 * std::copysign(sin * sin, alpha_rad) * std::cos(alpha_rad);
}

double FixedWing::drag_coefficient(double alpha_rad) const {
  const double linear = lift.zero + lift.alpha_per_rad * alpha_rad;
  const double aspect = span_m * span_m / wing_area_m2;
  return drag.parasitic + linear * linear / (std::numbers::pi * drag.oswald * aspect);
}

double FixedWing::alpha_of_most_lift_rad() const {
  constexpr double kEnd_rad = 0.5 * std::numbers::pi, kStep_rad = 1e-3;
  double most_rad = 0.0;
  // The first peak: that of a wing, not of the plate behind the stall.
  for (double alpha = -0.2; alpha < kEnd_rad; alpha += kStep_rad) {
    most_rad = alpha;
    if (lift_coefficient(alpha + kStep_rad) < lift_coefficient(alpha)) break;
  }
  return most_rad;
}

double FixedWing::thrust_n(double throttle, double airspeed_mps, double density_kg_per_m3) const {
  const double behind_mps = propeller.full_mps * throttle;
  return 0.5 * density_kg_per_m3 * propeller.area_m2 * propeller.coefficient *
         (behind_mps * behind_mps - airspeed_mps * airspeed_mps);
}

double FixedWing::throttle_of(double thrust_n, double airspeed_mps,
                              double density_kg_per_m3) const {
  const double behind_mps2 =
      2.0 * thrust_n / (density_kg_per_m3 * propeller.area_m2 * propeller.coefficient) +
      airspeed_mps * airspeed_mps;
  return std::copysign(std::sqrt(std::abs(behind_mps2)), behind_mps2) / propeller.full_mps;
}

bool FixedWing::has_rudder() const {
  // Ailerons and rudder together turn about x and z by any moments.
  const double together =
      roll.aileron_per_rad * yaw.rudder_per_rad - roll.rudder_per_rad * yaw.aileron_per_rad;
  constexpr double kLeast = 1e-6;
  return yaw.rudder_per_rad != 0.0 && std::abs(together) > kLeast;
}

double FixedWing::lateral_departure_per_rad() const {
  return yaw.beta_per_rad - roll.beta_per_rad * yaw.aileron_per_rad / roll.aileron_per_rad;
}

double Airflow::alpha_rad() const {
  return std::atan2(-through_air_body_mps.z(), through_air_body_mps.x());
}

double Airflow::beta_rad() const {
  const double speed = speed_mps();
  return speed > 0.0 ? std::asin(std::clamp(-through_air_body_mps.y() / speed, -1.0, 1.0)) : 0.0;
}

WingForces wing_forces(const FixedWing& vehicle, const Airflow& flow,
                       const WingControls& controls) {
  const double speed_mps = flow.speed_mps();
  const double alpha = flow.alpha_rad(), beta = flow.beta_rad();
  // Forward, right, down.
  const double p = flow.turn_rate_body_radps.x(), q = -flow.turn_rate_body_radps.y(),
               r = -flow.turn_rate_body_radps.z();
  const double force_n =
      0.5 * flow.density_kg_per_m3 * speed_mps * speed_mps * vehicle.wing_area_m2;
  const double force_by_rate = 0.25 * flow.density_kg_per_m3 * speed_mps * vehicle.wing_area_m2;
  const auto in_plane = [&](double by_alpha, double by_q, double by_elevator) {
    return force_n * (by_alpha + by_elevator * controls.elevator_rad) +
           force_by_rate * vehicle.chord_m * by_q * q;
  };
  const auto to_side = [&](const SideCoefficients& c) {
    return force_n * (c.zero + c.beta_per_rad * beta + c.aileron_per_rad * controls.aileron_rad +
                      c.rudder_per_rad * controls.rudder_rad) +
           force_by_rate * vehicle.span_m * (c.p_per_rad * p + c.r_per_rad * r);
  };
  const double lift_n = in_plane(vehicle.lift_coefficient(alpha), vehicle.lift.q_per_rad,
                                 vehicle.lift.elevator_per_rad);
  const double drag_n = in_plane(vehicle.drag_coefficient(alpha), vehicle.drag.q_per_rad,
                                 vehicle.drag.elevator_per_rad);
  const double pitch_nm =
      vehicle.chord_m * in_plane(vehicle.pitch.zero + vehicle.pitch.alpha_per_rad * alpha,
                                 vehicle.pitch.q_per_rad, vehicle.pitch.elevator_per_rad);
  const double thrust_n = vehicle.thrust_n(controls.throttle, speed_mps, flow.density_kg_per_m3);
  const double sin = std::sin(alpha), cos = std::cos(alpha);
  return {.force_body_n = {thrust_n - drag_n * cos + lift_n * sin, -to_side(vehicle.side),
                           drag_n * sin + lift_n * cos},
          .moment_body_nm = {vehicle.span_m * to_side(vehicle.roll), -pitch_nm,
                             -vehicle.span_m * to_side(vehicle.yaw)},
          .lift_n = lift_n,
          .drag_n = drag_n,
          .thrust_n = thrust_n};
}

}  // namespace terracast::geo
