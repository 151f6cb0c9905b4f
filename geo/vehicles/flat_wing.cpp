#include "geo/vehicles/flat_wing.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "geo/atmosphere.h"
#include "geo/gravity.h"
#include "geo/paths/changing.h"
#include "geo/paths/place.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;

constexpr double kLeastAirspeed_mps = 0.1;
/// Values at even distances through which a polynomial goes, for its derivatives.
constexpr long kStencil = 7;
using JetWeights = Eigen::Matrix<double, 4, kStencil>;

/// Weights of seven values in the value and first three derivatives at one of them, by the share of a distance.
JetWeights jet_weights(long at) {
  Eigen::Matrix<double, kStencil, kStencil> powers;
  for (long k = 0; k < kStencil; ++k)
    for (long power = 0; power < kStencil; ++power)
      powers(k, power) = std::pow(static_cast<double>(k - at), static_cast<double>(power));
  const JetWeights coefficients = powers.inverse().topRows<4>();
  return Eigen::Vector4d(1.0, 1.0, 2.0, 6.0).asDiagonal() * coefficients;
}

}  // namespace

double density_at_kg_per_m3(const WorldFrame& frame, const Vector3d& place_world) {
  const double height_m = frame.geodetic_from_world(place_world).height_m;
  return air_density_kg_per_m3(geopotential_height_m(height_m), {});
}

CoordinatedFlight::CoordinatedFlight(const WorldFrame& frame, const FixedWing& vehicle)
    : frame_(frame), vehicle_(vehicle), earth_rate_world_(earth_rate_world_radps(frame)) {
  vehicle.validate();
  most_alpha_rad_ = vehicle.alpha_of_most_lift_rad();
  most_lift_coefficient_ = vehicle.lift_coefficient(most_alpha_rad_);
}

Vector3d CoordinatedFlight::specific_force_mps2(const Vector3d& place_world,
                                                const Vector3d& velocity_world_mps,
                                                const Vector3d& acceleration_world_mps2) const {
  return acceleration_world_mps2 + 2.0 * earth_rate_world_.cross(velocity_world_mps) -
         gravity_world_mps2(frame_, place_world);
}

double CoordinatedFlight::needed_lift_coefficient(const Vector3d& place_world,
                                                  const Vector3d& velocity_world_mps,
                                                  const Vector3d& acceleration_world_mps2,
                                                  const Vector3d& wind_world_mps) const {
  const Vector3d force =
      specific_force_mps2(place_world, velocity_world_mps, acceleration_world_mps2);
  const Vector3d through_air = velocity_world_mps - wind_world_mps;
  const double airspeed_mps = std::max(through_air.norm(), kLeastAirspeed_mps);
  const Vector3d forward = through_air / airspeed_mps;
  return vehicle_.mass_kg * (force - force.dot(forward) * forward).norm() /
         (0.5 * density_at_kg_per_m3(frame_, place_world) * airspeed_mps * airspeed_mps *
          vehicle_.wing_area_m2);
}

std::optional<WingPose> CoordinatedFlight::pose(const Vector3d& place_world,
                                                const Vector3d& velocity_world_mps,
                                                const Vector3d& acceleration_world_mps2,
                                                const Vector3d& wind_world_mps,
                                                const Vector3d& wind_rate_world_mps2) const {
  const Vector3d force =
      specific_force_mps2(place_world, velocity_world_mps, acceleration_world_mps2);
  const Vector3d through_air = velocity_world_mps - wind_world_mps;
  const double airspeed_mps = through_air.norm();
  if (!(airspeed_mps > kLeastAirspeed_mps)) return std::nullopt;
  const Vector3d forward = through_air / airspeed_mps;
  const double along_mps2 = force.dot(forward);
  const Vector3d across = force - along_mps2 * forward;
  const double across_mps2 = across.norm();
  if (!(across_mps2 > 0.0)) return std::nullopt;
  const Vector3d upward = across / across_mps2;
  const double density = density_at_kg_per_m3(frame_, place_world);
  const double pressure_n = 0.5 * density * airspeed_mps * airspeed_mps * vehicle_.wing_area_m2;
  // The way through the air turns upward by the pitch rate, where the angle of attack stays.
  const double pitch_radps =
      (acceleration_world_mps2 - wind_rate_world_mps2).dot(upward) / airspeed_mps;
  const double pitch_share = vehicle_.chord_m * pitch_radps / (2.0 * airspeed_mps);
  const auto elevator_at = [&](double alpha) {
    return -(vehicle_.pitch.zero + vehicle_.pitch.alpha_per_rad * alpha +
             vehicle_.pitch.q_per_rad * pitch_share) /
           vehicle_.pitch.elevator_per_rad;
  };
  const auto thrust_at = [&](double alpha) {
    const double drag_n =
        pressure_n * (vehicle_.drag_coefficient(alpha) + vehicle_.drag.q_per_rad * pitch_share +
                      vehicle_.drag.elevator_per_rad * elevator_at(alpha));
    return (vehicle_.mass_kg * along_mps2 + drag_n) / std::cos(alpha);
  };
  // Lift with the thrust's share across, less what must act there.
  const auto more_n = [&](double alpha) {
    const double lift_n =
        pressure_n * (vehicle_.lift_coefficient(alpha) + vehicle_.lift.q_per_rad * pitch_share +
                      vehicle_.lift.elevator_per_rad * elevator_at(alpha));
    return lift_n + thrust_at(alpha) * std::sin(alpha) - vehicle_.mass_kg * across_mps2;
  };
  constexpr double kLeastAlpha_rad = -0.35;
  double low = kLeastAlpha_rad, high = most_alpha_rad_;
  double low_n = more_n(low), high_n = more_n(high);
  if (!(low_n <= 0.0 && high_n >= 0.0)) return std::nullopt;
  // Newton's method by secants, kept within the bracket.
  double alpha = low + (high - low) * -low_n / (high_n - low_n);
  constexpr int kMostSteps = 60;
  constexpr double kAside_rad = 1e-6, kEnough_rad = 1e-14;
  for (int step = 0; step < kMostSteps; ++step) {
    const double lack_n = more_n(alpha);
    (lack_n < 0.0 ? low : high) = alpha;
    const double slope =
        (more_n(alpha + kAside_rad) - more_n(alpha - kAside_rad)) / (2.0 * kAside_rad);
    double next = alpha - lack_n / slope;
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    const double change = std::abs(next - alpha);
    alpha = next;
    if (change < kEnough_rad) break;
  }
  const Vector3d nose = std::cos(alpha) * forward + std::sin(alpha) * upward;
  const Vector3d top = std::cos(alpha) * upward - std::sin(alpha) * forward;
  Eigen::Matrix3d axes;
  axes << nose, top.cross(nose), top;
  const Vector3d up = frame_.up_world(place_world);
  const double thrust_n = thrust_at(alpha);
  return WingPose{.world_from_body = Eigen::Quaterniond(axes),
                  .airspeed_mps = airspeed_mps,
                  .alpha_rad = alpha,
                  .elevator_rad = elevator_at(alpha),
                  .lift_coefficient =
                      (vehicle_.mass_kg * across_mps2 - thrust_n * std::sin(alpha)) / pressure_n,
                  .thrust_n = thrust_n,
                  .throttle = vehicle_.throttle_of(thrust_n, airspeed_mps, density),
                  .bank_rad = std::atan2(up.dot(upward.cross(forward)), up.dot(upward))};
}

void WingLimits::describe(core::SchemaVisitor& visit) {
  visit.key("max_bank_deg", max_bank_deg, "Bank beyond which a plan is refused.",
            core::between(1.0, 85.0));
  visit.key("max_roll_rate_deg_per_s", max_roll_rate_deg_per_s,
            "Roll rate beyond which a plan is refused.", core::between(0.1, 1000.0));
}

FlatWingFlight::FlatWingFlight(CoordinatedFlight flight, std::unique_ptr<Trajectory> plan,
                               std::optional<double> lap_s, std::shared_ptr<const FlightAir> air,
                               const WingLimits& limits)
    : flight_(std::move(flight)), plan_(std::move(plan)), lap_s_(lap_s), air_(std::move(air)) {
  constexpr double kNode_s = 0.02;
  const double whole_s = lap_s_ ? *lap_s_ : plan_->duration_s();
  const auto count = std::max(static_cast<long>(std::ceil(whole_s / kNode_s)), kStencil);
  spacing_s_ = whole_s / static_cast<double>(count);
  // A closed plan is known on both sides of its ends, where an open one jumps to what it goes on with.
  const long more = lap_s_ ? kStencil / 2 : 0;
  std::vector<Eigen::Vector4d> parts;
  for (long i = -more; i <= count + more; ++i) {
    const double time_s = spacing_s_ * static_cast<double>(i);
    const std::optional<WingPose> pose = pose_at(time_s);
    if (!pose) refuse_stall(time_s);
    if (time_s >= 0.0 && time_s <= plan_->duration_s()) check(time_s, *pose, limits);
    const Eigen::Quaterniond& q = pose->world_from_body;
    Eigen::Vector4d part(q.w(), q.x(), q.y(), q.z());
    if (!parts.empty() && part.dot(parts.back()) < 0.0) part = -part;
    parts.push_back(part);
  }
  std::array<JetWeights, kStencil> weights;
  for (long at = 0; at < kStencil; ++at) weights[static_cast<std::size_t>(at)] = jet_weights(at);
  const auto last_begin = static_cast<long>(parts.size()) - kStencil;
  const auto jet_at = [&](long node) {
    const long begin = std::clamp(node + more - kStencil / 2, 0L, last_begin);
    const JetWeights& of_values = weights[static_cast<std::size_t>(node + more - begin)];
    Jet<Eigen::Vector4d> jet;
    for (long order = 0; order < 4; ++order) {
      Eigen::Vector4d sum = Eigen::Vector4d::Zero();
      for (long k = 0; k < kStencil; ++k)
        sum += of_values(order, k) * parts[static_cast<std::size_t>(begin + k)];
      jet[static_cast<std::size_t>(order)] = sum;
    }
    jet[0] = parts[static_cast<std::size_t>(node + more)];
    return jet;
  };
  for (long node = 0; node < count; ++node) pieces_.emplace_back(jet_at(node), jet_at(node + 1));
  for (long node = 0; node <= count; ++node) {
    const double time_s = spacing_s_ * static_cast<double>(node);
    if (time_s > plan_->duration_s()) continue;
    const double roll_degps =
        degrees_from_radians(std::abs(at(time_s).angular_velocity_body_radps.x()));
    if (roll_degps > limits.max_roll_rate_deg_per_s)
      core::fail(
          core::ErrorKind::Input,
          "the aircraft rolls by {:.1f} deg/s at {}, more than max_roll_rate_deg_per_s = {}; "
          "fly slower, put waypoints farther apart, or allow more",
          roll_degps, where(time_s), limits.max_roll_rate_deg_per_s);
  }
}

Vector3d FlatWingFlight::wind_world_mps(double time_s) const {
  if (!air_) return Vector3d::Zero();
  double on_plan_s = time_s;
  if (lap_s_) on_plan_s -= *lap_s_ * std::floor(time_s / *lap_s_);
  return air_->wind.mean_mps(air_->place_in_air(flight_.frame(), on_plan_s,
                                                plan_->at(time_s).world_from_body.translation));
}

std::optional<WingPose> FlatWingFlight::pose_at(double time_s) const {
  const MotionState state = plan_->at(time_s);
  constexpr double kNear_s = 1e-2;
  const Vector3d wind_rate =
      air_ ? Vector3d((wind_world_mps(time_s + kNear_s) - wind_world_mps(time_s - kNear_s)) /
                      (2.0 * kNear_s))
           : Vector3d::Zero();
  return flight_.pose(state.world_from_body.translation, state.velocity_world_mps,
                      state.acceleration_world_mps2, wind_world_mps(time_s), wind_rate);
}

std::string FlatWingFlight::where(double time_s) const {
  return fmt::format(
      "t = {:.1f} s ({})", time_s,
      text_of(flight_.frame().geodetic_from_world(plan_->at(time_s).world_from_body.translation)));
}

void FlatWingFlight::refuse_stall(double time_s) const {
  const MotionState state = plan_->at(time_s);
  const Vector3d wind = wind_world_mps(time_s);
  const double needed =
      flight_.needed_lift_coefficient(state.world_from_body.translation, state.velocity_world_mps,
                                      state.acceleration_world_mps2, wind);
  const double airspeed_mps = (state.velocity_world_mps - wind).norm();
  core::fail(core::ErrorKind::Input,
             "the wing stalls at {}: at {:.1f} m/s through the air it would need a lift "
             "coefficient of {:.2f}, and has up to {:.2f}; fly faster than {:.1f} m/s through the "
             "air there, or put waypoints farther apart, so that turns are wider",
             where(time_s), airspeed_mps, needed, flight_.most_lift_coefficient(),
             airspeed_mps * std::sqrt(needed / flight_.most_lift_coefficient()));
}

void FlatWingFlight::check(double time_s, const WingPose& pose, const WingLimits& limits) const {
  using core::ErrorKind;
  using core::fail;
  const double bank_deg = degrees_from_radians(std::abs(pose.bank_rad));
  if (bank_deg > limits.max_bank_deg)
    fail(ErrorKind::Input,
         "the aircraft banks by {:.1f} deg at {}, more than max_bank_deg = {}; fly slower, put "
         "waypoints farther apart, so that turns are wider, or allow more",
         bank_deg, where(time_s), limits.max_bank_deg);
  if (pose.throttle > 1.0)
    fail(ErrorKind::Input,
         "the aircraft needs a thrust of {:.2f} N at {}, and its propeller gives {:.2f} N at "
         "{:.1f} m/s through the air; climb less steeply, or fly slower",
         pose.thrust_n, where(time_s),
         flight_.vehicle().thrust_n(
             1.0, pose.airspeed_mps,
             density_at_kg_per_m3(flight_.frame(), plan_->at(time_s).world_from_body.translation)),
         pose.airspeed_mps);
  if (pose.throttle < 0.0)
    fail(ErrorKind::Input,
         "the aircraft has to brake by {:.2f} N at {}, more than its propeller does at idle; "
         "descend less steeply, or fly faster",
         -pose.thrust_n, where(time_s));
  const double elevator_deg = degrees_from_radians(std::abs(pose.elevator_rad));
  if (elevator_deg > flight_.vehicle().max_deflection_deg)
    fail(ErrorKind::Input,
         "the aircraft needs {:.1f} deg of elevator at {}, more than the vehicle's "
         "max_deflection_deg = {}; fly faster, or turn less tightly",
         elevator_deg, where(time_s), flight_.vehicle().max_deflection_deg);
}

MotionState FlatWingFlight::at(double time_s) const {
  MotionState state = plan_->at(time_s);
  double on_curve_s = time_s;
  if (lap_s_) on_curve_s -= *lap_s_ * std::floor(time_s / *lap_s_);
  const double inside_s =
      std::clamp(on_curve_s, 0.0, spacing_s_ * static_cast<double>(pieces_.size()));
  const double place = inside_s / spacing_s_;
  const double index = std::clamp(std::floor(place), 0.0, static_cast<double>(pieces_.size() - 1));
  const Jet<Eigen::Vector4d> jet = pieces_[static_cast<std::size_t>(index)].at(place - index);
  const double per_s = 1.0 / spacing_s_;
  const Turning turning = turning_of_parts(jet[0], per_s * jet[1], per_s * per_s * jet[2]);
  state.world_from_body.rotation = turning.world_from_body.normalized();
  state.angular_velocity_body_radps = turning.angular_velocity_body_radps;
  state.angular_acceleration_body_radps2 = turning.angular_acceleration_body_radps2;
  if (inside_s != on_curve_s) {
    state.world_from_body.rotation =
        state.world_from_body.rotation *
        rotation_of((on_curve_s - inside_s) * state.angular_velocity_body_radps);
    state.angular_acceleration_body_radps2.setZero();
  }
  return state;
}

std::vector<double> FlatWingFlight::knots_s() const {
  std::vector<double> knots_s = plan_->knots_s();
  const double lap_s = lap_s_ ? *lap_s_ : duration_s();
  for (double lap_start_s = 0.0; lap_start_s < duration_s(); lap_start_s += lap_s)
    for (std::size_t i = 0; i <= pieces_.size(); ++i) {
      const double time_s = lap_start_s + spacing_s_ * static_cast<double>(i);
      if (time_s > 0.0 && time_s < duration_s()) knots_s.push_back(time_s);
    }
  return sorted_knots(std::move(knots_s));
}

}  // namespace terracast::geo
