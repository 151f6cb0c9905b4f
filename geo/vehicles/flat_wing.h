#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/schema.h"
#include "geo/air/flight_air.h"
#include "geo/paths/hermite.h"
#include "geo/trajectory.h"
#include "geo/vehicles/fixed_wing.h"

/// Fixed-wing aircraft that fly a planned path exactly.
namespace terracast::geo {

/// How an aircraft holds itself to be accelerated as a path is.
struct WingPose {
  Eigen::Quaterniond world_from_body;
  double airspeed_mps;
  double alpha_rad;
  double elevator_rad;
  double lift_coefficient;  ///< that the wing has to give
  double thrust_n;
  double throttle;  ///< beyond 0 and 1 where the propeller cannot give the thrust
  double
      bank_rad;  ///< of the lift about the way through the air: positive with the right wing down
};

/// Density of the standard atmosphere; heights above the ellipsoid stand for those above mean sea level, from which
/// they differ by up to 107 m: 1 % of the density.
double density_at_kg_per_m3(const WorldFrame& frame, const Eigen::Vector3d& place_world);

/// The attitude of coordinated flight: the nose in the plane of the way through the air and of the force that must act,
/// without sideslip and without a side force, at the angle of attack that gives the lift. The elevator
/// balances the pitching moment of a steady turn about the left axis.
/// source   Beard and McLain, Small Unmanned Aircraft (2012), sections 9.2 (coordinated turn) and 5.3 (trim), on
///          a turning Earth with the gravity of the place
class CoordinatedFlight {
 public:
  /// throws   Config: FixedWing::validate
  CoordinatedFlight(const WorldFrame& frame, const FixedWing& vehicle);

  /// acceleration_world_mps2   that the body is to have
  /// wind_world_mps, wind_rate_world_mps2   at the body, and as it changes along the way
  /// returns   nothing where the wing stalls first, or nothing flows about it
  /// accuracy  1e-13 of the angle of attack
  std::optional<WingPose> pose(const Eigen::Vector3d& place_world,
                               const Eigen::Vector3d& velocity_world_mps,
                               const Eigen::Vector3d& acceleration_world_mps2,
                               const Eigen::Vector3d& wind_world_mps,
                               const Eigen::Vector3d& wind_rate_world_mps2) const;

  /// What the wing would have to lift, as a coefficient, in that state without regard to the stall.
  double needed_lift_coefficient(const Eigen::Vector3d& place_world,
                                 const Eigen::Vector3d& velocity_world_mps,
                                 const Eigen::Vector3d& acceleration_world_mps2,
                                 const Eigen::Vector3d& wind_world_mps) const;
  double most_lift_coefficient() const { return most_lift_coefficient_; }
  const FixedWing& vehicle() const { return vehicle_; }
  const WorldFrame& frame() const { return frame_; }

 private:
  /// What acts besides weight, by the mass.
  Eigen::Vector3d specific_force_mps2(const Eigen::Vector3d& place_world,
                                      const Eigen::Vector3d& velocity_world_mps,
                                      const Eigen::Vector3d& acceleration_world_mps2) const;

  WorldFrame frame_;
  FixedWing vehicle_;
  Eigen::Vector3d earth_rate_world_;
  double most_alpha_rad_, most_lift_coefficient_;
};

/// What an aircraft may do on a planned path.
struct WingLimits {
  double max_bank_deg = 45.0;
  double max_roll_rate_deg_per_s = 90.0;

  void describe(core::SchemaVisitor& visit);
};

/// A flight whose places are those of a plan and whose attitudes are those of coordinated flight in the mean wind.
/// Attitudes are a curve through those at even distances of time, three times continuously differentiable; before the
/// beginning and after the end of an open plan they go on turning at the rate there. Threads: safe.
class FlatWingFlight final : public Trajectory {
 public:
  /// plan       places and their derivatives; acceleration twice continuously differentiable
  /// lap_s      after which a closed plan is the same again; nothing: it is open
  /// air        its mean wind counts; null: calm
  /// accuracy   between nodes attitudes are within 1e-8 rad of CoordinatedFlight's (FlatWing.…)
  /// throws     Input: a stall, more bank or roll rate than the limits, thrust or elevator that the aircraft does not have,
  ///            with time, place, value and a way out
  FlatWingFlight(CoordinatedFlight flight, std::unique_ptr<Trajectory> plan,
                 std::optional<double> lap_s, std::shared_ptr<const FlightAir> air,
                 const WingLimits& limits);

  double duration_s() const override { return plan_->duration_s(); }
  MotionState at(double time_s) const override;
  std::vector<double> knots_s() const override;
  Eigen::Vector3d wind_world_mps(double time_s) const override;
  /// As it is computed at the time, not from the curve.
  std::optional<WingPose> pose_at(double time_s) const;

 private:
  void check(double time_s, const WingPose& pose, const WingLimits& limits) const;
  [[noreturn]] void refuse_stall(double time_s) const;
  std::string where(double time_s) const;

  CoordinatedFlight flight_;
  std::unique_ptr<Trajectory> plan_;
  std::optional<double> lap_s_;
  std::shared_ptr<const FlightAir> air_;
  double spacing_s_ = 0.0;
  std::vector<SepticPiece<Eigen::Vector4d>> pieces_;
};

}  // namespace terracast::geo
