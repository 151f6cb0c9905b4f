#pragma once

#include <memory>

#include "geo/geodesy.h"
#include "geo/paths/arc_length.h"
#include "geo/paths/attitude.h"
#include "geo/paths/path.h"
#include "geo/paths/speed_profile.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// A body that travels a path at given speeds, its z axis as near to the local up (the ellipsoid's
/// normal) as its attitude lets it. A closed path is travelled `laps` times.
class PathMotion final : public Trajectory {
 public:
  PathMotion(std::shared_ptr<const Path> path, const WorldFrame& frame,
             const std::vector<SpeedAt>& speeds, const Attitude& attitude, double laps);

  double duration_s() const override { return laps_ * lap_s_; }
  MotionState at(double time_s) const override;
  std::vector<double> knots_s() const override;

  double lap_s() const { return lap_s_; }
  const ArcLength& arc_length() const { return arc_length_; }
  const Path& path() const { return *path_; }
  /// Length along the lap at a time of the lap.
  double length_at_time(double time_s) const { return speeds_.at(time_s).length_m; }

 private:
  PointMotion motion_at(double lap_time_s) const;

  std::shared_ptr<const Path> path_;
  ArcLength arc_length_;
  SpeedProfile speeds_;
  double laps_;
  double lap_s_;
  Steering steering_;  ///< over a lap's time
};

}  // namespace terracast::geo
