#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "geo/air/flight_air.h"
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
    Eigen::Vector3d air_way = Eigen::Vector3d::Zero();  ///< as AirWay
    Eigen::Vector3d air_way_rate = Eigen::Vector3d::Zero();
  };

  /// first_s       time of the first node, 0 or before; the motion proper lasts from 0 to duration_s
  /// place_world   of the first node
  FlownMotion(double first_s, double spacing_s, const Eigen::Vector3d& place_world,
              const std::vector<Node>& nodes, double duration_s);

  double duration_s() const override { return duration_s_; }
  /// Before the first node and after the last one: with the acceleration and the angular velocity that it has there.
  MotionState at(double time_s) const override;
  std::vector<double> knots_s() const override;
  /// That at the motion's place after its way through the air; between nodes the way is a cubic, within 1e-6 of a
  /// length.
  Eigen::Vector3d wind_world_mps(double time_s) const override;
  /// The air in which it was flown; null: calm.
  void set_air(const WorldFrame& frame, std::shared_ptr<const FlightAir> air);

 private:
  struct Piece {
    Eigen::Vector3d begin_world;
    SepticPiece<Eigen::Vector3d> moved;
    SepticPiece<Eigen::Vector4d> rotation;
    std::array<Eigen::Vector3d, 2> air_way,
        air_way_rate;  ///< at both ends, by the share of a piece
  };
  struct Place {
    std::size_t piece;
    double share;
  };
  Place place_at(double time_s) const;
  MotionState inside(double time_s) const;
  double last_s() const { return first_s_ + spacing_s_ * static_cast<double>(pieces_.size()); }

  double first_s_, spacing_s_, duration_s_;
  std::vector<Piece> pieces_;
  std::optional<WorldFrame> frame_;
  std::shared_ptr<const FlightAir> air_;
};

}  // namespace terracast::geo
