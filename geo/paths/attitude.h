#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "geo/geodesy.h"
#include "geo/paths/changing.h"
#include "geo/paths/uniform_spline.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// Standard gravity, which a coordinated turn is balanced against.
inline constexpr double kGravity_mps2 = 9.80665;

/// Where the body's axes point.
struct Attitude {
  enum class Nose {
    AlongPath,      ///< x along the velocity
    Level,          ///< x along the velocity's horizontal part
    TowardsPoint,   ///< x along the horizontal direction to `target_world`
    AlongDirection  ///< x along the horizontal part of `direction_world`
  };
  Nose nose = Nose::AlongPath;
  Eigen::Vector3d target_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitX();
  /// Roll so that lateral acceleration and gravity add up along the body's z: tan(roll) = a_lateral
  /// / g, which on a level circle is v^2 / (r g). Limited, and averaged over a time. None: no roll.
  struct Bank {
    double limit_rad;
    double smoothing_s;
  };
  std::optional<Bank> bank;
  /// Of the roll and of held headings over time.
  Continuity continuity = Continuity::Second;
  /// Motions that stop or hover: below this horizontal speed the nose turns from the velocity, which
  /// has no direction at rest, to the level heading of the faster times before and after. 0: the
  /// motion never stops.
  double slow_mps = 0.0;
};

/// How a point moves in the world at one time.
struct PointMotion {
  Eigen::Vector3d position, velocity, acceleration, jerk;

  /// The motion `later_s` later, or earlier, if it goes on with this acceleration.
  PointMotion extended(double later_s) const;
};

/// Turns a body along the way that it travels, its z axis as near to the local up (the ellipsoid's
/// normal) as its attitude lets it. Threads: safe.
class Steering {
 public:
  /// motion   the body's, over [0, duration_s]; used here only
  Steering(const WorldFrame& frame, const Attitude& attitude,
           const std::function<PointMotion(double time_s)>& motion, double duration_s,
           bool is_closed);

  /// Pose of the body and its derivatives.
  /// time_s   any; before 0 and after the duration, roll and held headings settle within a few knots of their splines
  MotionState state_at(double time_s, const PointMotion& motion) const;
  /// Times between which the roll and held headings have all derivatives, in no order.
  std::vector<double> knots_s() const;

 private:
  void hold_heading(const std::function<PointMotion(double)>& motion, double duration_s);
  void make_roll(const std::function<PointMotion(double)>& motion, double duration_s,
                 bool is_closed);
  Changing direction_of_travel(double time_s, const PointMotion& motion, const Changing& up) const;

  WorldFrame frame_;
  Attitude attitude_;
  std::optional<UniformSpline> held_heading_rad_;  ///< clockwise from north, over time
  std::optional<UniformSpline> roll_rad_;          ///< over time; nothing: no roll
};

}  // namespace terracast::geo
