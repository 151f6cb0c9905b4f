#pragma once

#include <vector>

#include "geo/paths/hermite.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// A motion that was computed step by step, as one smooth curve: between nodes at equal distances of time a polynomial of
/// degree 7 for each coordinate of the place, and for each part of the quaternion, which is normalised. It has the
/// nodes' values and first three derivatives, and is three times continuously differentiable. Threads: safe.
class FlownMotion final : public Trajectory {
 public:
  /// What is known at a node. Derivatives are by time.
  struct Node {
    Eigen::Vector3d moved_world;  ///< since the node before it: small, so that its digits count
    Eigen::Vector3d velocity, acceleration, jerk;
    Jet<Eigen::Vector4d> rotation;  ///< world_from_body, w x y z; neighbours in the same half
  };

  /// first_s       time of the first node, 0 or before; the motion proper lasts from 0 to duration_s
  /// place_world   of the first node
  FlownMotion(double first_s, double spacing_s, const Eigen::Vector3d& place_world,
              const std::vector<Node>& nodes, double duration_s);

  double duration_s() const override { return duration_s_; }
  /// Before the first node and after the last one: with the acceleration and the angular velocity that it has there.
  MotionState at(double time_s) const override;
  std::vector<double> knots_s() const override;

 private:
  struct Piece {
    Eigen::Vector3d begin_world;
    SepticPiece<Eigen::Vector3d> moved;
    SepticPiece<Eigen::Vector4d> rotation;
  };
  MotionState inside(double time_s) const;
  double last_s() const { return first_s_ + spacing_s_ * static_cast<double>(pieces_.size()); }

  double first_s_, spacing_s_, duration_s_;
  std::vector<Piece> pieces_;
};

}  // namespace terracast::geo
