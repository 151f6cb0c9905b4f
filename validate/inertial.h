#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "validate/geometry.h"

/// The validator's own inertial navigation: gravity, samples as a function of time, and their integration.
namespace terracast::validate {

/// WGS84's rate of turning, rad/s, about the third axis of the Earth.
inline constexpr double kEarthRate_radps = 7.292115e-5;

/// Gravity of WGS84's normal field, the centrifugal part included, m/s^2, by zonal harmonics up to the twelfth.
/// accuracy   1e-11 m/s^2 from the ground to 50 km; InertialNavigation.…
Eigen::Vector3d normal_gravity_ecef_mps2(const Eigen::Vector3d& point_ecef);

/// Turn rate against the stars and specific force, along the sensor's axes.
struct InertialReading {
  Eigen::Vector3d turn_rate_radps;
  Eigen::Vector3d force_mps2;
};

/// Samples k / rate as a function of time: by the polynomial through eight of them about it, or, of means over the time
/// since the sample before, by the derivative of the one through eight of their sums.
class InertialSamples {
 public:
  InertialSamples(std::vector<InertialReading> samples, double rate_hz, bool is_integrated);

  /// First and last time between samples, s; a step before and after them the polynomial at that end goes on.
  double first_s() const { return 0.0; }
  double last_s() const { return static_cast<double>(samples_.size() - 1) / rate_hz_; }
  double step_s() const { return 1.0 / rate_hz_; }
  bool are_enough() const { return samples_.size() > num_nodes_; }
  InertialReading at(double time_s) const;
  /// The same of every second sample.
  InertialSamples thinned() const;
  /// The same samples, interpolated by the cubic through four of them; it differs where they jump or bend.
  InertialSamples of_lower_order() const;

 private:
  std::vector<InertialReading> samples_;  ///< of means: their sums times the step, 0 at time 0
  double rate_hz_;
  bool is_integrated_;
  std::size_t num_nodes_ = 8;
};

/// A sensor in the Earth's axes, which turn with it.
struct InertialState {
  Eigen::Vector3d place_ecef;
  Eigen::Vector3d velocity_ecef_mps;
  Eigen::Matrix3d ecef_from_sensor;
};

/// Readings at the ends and middles of the steps from a time to another one, each of a sample or less.
struct InertialLeg {
  double from_s = 0.0, step_s = 0.0;
  std::vector<InertialReading> readings;  ///< 2 n + 1 of n steps
  std::size_t num_steps() const { return readings.size() / 2; }
};
InertialLeg leg_of(const InertialSamples& samples, double from_s, double to_s);

/// Carries a state along a leg, by Runge's and Kutta's rule of the fourth order.
InertialState integrate(InertialState state, const InertialLeg& leg);

/// What integration may be off by: how differently other interpolations of the samples read, gathered step by step
/// without regard to signs. Where a reading bends or jumps between two samples, the polynomial through eight errs in the
/// mean over a step by at most 0.21 and 0.53 of that (measured for all phases).
struct InertialDoubt {
  double turn_rad = 0.0;
  double speed_mps = 0.0;
  double place_m = 0.0;

  void gather(const InertialLeg& leg, std::span<const InertialSamples> others);
};

}  // namespace terracast::validate
