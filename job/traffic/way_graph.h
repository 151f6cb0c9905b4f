#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "world/way_network.h"

namespace terracast::job {

/// A part of a way, gone along in one direction.
struct Arm {
  std::uint32_t part = 0;
  bool is_forward = true;
  bool operator==(const Arm&) const = default;
};

/// The ways of a world by what leaves each node. Threads: safe.
class WayGraph {
 public:
  explicit WayGraph(world::WayNetwork network);

  std::span<const world::WayPart> parts() const { return network_.parts; }
  const world::WayPart& part(const Arm& arm) const { return network_.parts[arm.part]; }
  double length_m(std::uint32_t part) const { return lengths_m_[part]; }

  /// All arms that begin where this one ends, its own way back among them.
  std::span<const Arm> after(const Arm& arm) const;
  /// World x, y of its line, in its direction, and z as WayPart has it.
  std::vector<Eigen::Vector3d> points(const Arm& arm) const;
  /// Of length 1, over its first and its last metres.
  Eigen::Vector2d direction_at_start(const Arm& arm) const;
  Eigen::Vector2d direction_at_end(const Arm& arm) const;
  /// How far one turns from an arm into the next: anticlockwise, rad.
  double turn_rad(const Arm& from, const Arm& to) const;

 private:
  world::WayNetwork network_;
  std::vector<double> lengths_m_;
  std::vector<std::uint32_t> first_of_node_;  ///< in arms_
  std::vector<Arm> arms_;
};

/// Of vehicles that go along a part in a direction: how many lanes there are, and how far the middle of one is to
/// the right of the line, seen in that direction. Lane 0 is at the side on which one drives. Tracks are lanes of trains.
int num_lanes(const world::WayPart& part, bool is_forward);
double lane_right_m(const world::WayPart& part, bool is_forward, int lane, bool on_left);

/// km/h, of what its source does not say: of its kind, lower between houses.
double speed_limit_kmph(const world::WayPart& part);

}  // namespace terracast::job
