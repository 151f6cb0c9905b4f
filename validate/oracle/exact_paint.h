#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "validate/oracle/box_tree.h"
#include "world/ground_paint.h"

namespace terracast::oracle {

/// What is painted at a place of the ground.
struct Paint {
  bool is_painted = false;
  bool is_marked = false;  ///< lines may be drawn there
  std::uint8_t semantic_class = 0;
  /// Within so little of a border that rounding may decide between this and what lies beside.
  bool is_tie = false;
};

/// The strips and areas of a tile, by docs/world.md alone. Threads: safe.
class ExactPaint {
 public:
  /// Places nearer to a border are ties: the rounding of a place at 100 km is 1e-11 m, of its
  /// distance from a line some times that.
  static constexpr double kTie_m = 1e-7;

  ExactPaint(const std::vector<world::Strip>& strips, const std::vector<world::Area>& areas);

  bool is_empty() const { return strips_.empty() && areas_.empty(); }
  Paint at(const Eigen::Vector2d& place_world) const;
  std::size_t num_bytes() const;

 private:
  std::vector<world::Strip> strips_;
  std::vector<world::Area> areas_;
  BoxTree strip_tree_, area_tree_;  ///< z from 0 to 0
};

}  // namespace terracast::oracle
