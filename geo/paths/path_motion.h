#pragma once

#include <memory>
#include <optional>

#include "geo/geodesy.h"
#include "geo/paths/arc_length.h"
#include "geo/paths/path.h"
#include "geo/paths/speed_profile.h"
#include "geo/paths/uniform_spline.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// Standard gravity, which a coordinated turn is balanced against.
inline constexpr double kGravity_mps2 = 9.80665;

/// Where the body's axes point.
struct Attitude {
  enum class Nose {
    AlongPath,    ///< x along the velocity
    Level,        ///< x along the velocity's horizontal part
    TowardsPoint  ///< x along the horizontal direction to `target_world`
  };
  Nose nose = Nose::AlongPath;
  Eigen::Vector3d target_world = Eigen::Vector3d::Zero();
  /// Roll so that lateral acceleration and gravity add up along the body's z: tan(roll) = a_lateral
  /// / g, which on a level circle is v^2 / (r g). Limited, and averaged over a time. None: no roll.
  struct Bank {
    double limit_rad;
    double smoothing_s;
  };
  std::optional<Bank> bank;
};

/// A body that travels a path at given speeds, its z axis as near to the local up (the ellipsoid's
/// normal) as its attitude lets it. A closed path is travelled `laps` times.
class PathMotion final : public Trajectory {
 public:
  PathMotion(std::shared_ptr<const Path> path, const WorldFrame& frame,
             const std::vector<SpeedAt>& speeds, const Attitude& attitude, double laps);

  double duration_s() const override { return laps_ * lap_s_; }
  BodyState at(double time_s) const override;

  double lap_s() const { return lap_s_; }
  const ArcLength& arc_length() const { return arc_length_; }
  const Path& path() const { return *path_; }
  /// Length along the lap at a time of the lap.
  double length_at_time(double time_s) const { return speeds_.at(time_s).length_m; }

 private:
  struct Motion {
    Eigen::Vector3d position, velocity, acceleration;
  };
  struct Axes {
    Eigen::Matrix3d world_from_axes;   ///< columns forward, left, up of the body before it rolls
    Eigen::Vector3d angular_velocity;  ///< in the world
  };
  Motion motion_at(double lap_time_s) const;
  Axes axes_at(const Motion& motion) const;
  void make_roll();

  std::shared_ptr<const Path> path_;
  WorldFrame frame_;
  ArcLength arc_length_;
  SpeedProfile speeds_;
  Attitude attitude_;
  double laps_;
  double lap_s_;
  std::optional<UniformSpline> roll_rad_;  ///< over a lap's time; nothing: no roll
};

}  // namespace terracast::geo
