#pragma once

#include <Eigen/Core>

#include "validate/oracle/exact_world.h"

namespace terracast::validate {

/// Whether a point of the ground is seen from a place, by exact rays; all in the world's frame.
/// threads   any, one object each
class Sight {
 public:
  /// Where a verdict may go either way: twice the half micrometre by which the decimals of a height
  /// can move a camera.
  static constexpr double kTie_m = 1e-6;

  Sight(const oracle::ExactWorld& terrain, const Eigen::Vector3d& eye_world,
        const Eigen::Vector3d& point_world)
      : terrain_(terrain), eye_(eye_world), point_(point_world) {}

  bool is_seen() const { return is_seen(eye_, point_); }
  /// Whether eye or point, moved by less than a tie, see each other or not, otherwise than as they
  /// stand.
  bool is_tie() const;
  /// How far the ground that the eye sees in the point's direction is from the point, along the
  /// normal there; +inf: no ground.
  double distance_from_ground_m() const;

 private:
  bool is_seen(const Eigen::Vector3d& eye, const Eigen::Vector3d& point) const;

  const oracle::ExactWorld& terrain_;
  Eigen::Vector3d eye_, point_;
};

}  // namespace terracast::validate
