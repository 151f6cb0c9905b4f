#pragma once

#include <cstdint>
#include <vector>

#include "tiler/vegetation/plant.h"

namespace terracast::tiler {

/// Outline of a crown: how long branches are by the share of the crown that lies above them (the
/// ShapeRatio of Weber and Penn).
enum class CrownShape {
  Pointed,  ///< a cone up to its tip: ours
  Conical,
  Spherical,
  Hemispherical,
  Cylindrical,
  TaperedCylindrical,
  Flame,
  TendFlame,
};

/// Of all stems of one order.
struct StemRule {
  int num_stems = 0;              ///< on each stem of the order before; order 0: 1
  double length = 1.0;            ///< share of the parent's; order 0: of the height
  double length_variation = 0.0;  ///< ± of the same
  double down_angle_deg = 60.0;   ///< away from the parent's direction
  double down_angle_variation_deg =
      0.0;                  ///< below 0: from the crown's base to its top, not at random
  double turn_deg = 140.0;  ///< round the parent from one to the next
  double turn_variation_deg = 20.0;
  int whorl = 1;  ///< how many leave the parent at the same height
  int num_segments = 3;
  double curve_deg = 0.0;            ///< over the whole length, away from the trunk
  double curve_variation_deg = 0.0;  ///< over the whole length, in any direction
  double upward = 0.0;               ///< pull towards the sky; below 0: hanging
  double num_forks = 0.0;            ///< how often the stem parts in two, on average
  double fork_angle_deg = 25.0;
};

/// How leaves, or sprays of them, stand on the stems of the last order.
struct LeafRule {
  int num_leaves = 6;  ///< on a stem of mean length
  double first = 0.2;  ///< share of the stem without any
  double length_m = 0.4;
  double width_m = 0.25;
  double size_variation = 0.25;  ///< share
  double down_angle_deg = 50.0;  ///< away from the stem
  bool in_two_rows = false;      ///< flat to both sides, as on spruce; otherwise all round
  double hanging = 0.0;          ///< 0 … 1: how far they droop
  double fold = 0.12;            ///< edges lifted by this share of the length
};

/// A tree by its numbers.
struct TreeRules {
  double height_m = 15.0;
  double height_variation = 0.1;  ///< share
  CrownShape shape = CrownShape::Spherical;
  double bare_share = 0.2;      ///< of the trunk below the crown
  double trunk_ratio = 0.02;    ///< radius by length
  double ratio_power = 1.2;     ///< of a branch's radius by its share of the parent's length
  double flare = 0.6;           ///< how much thicker the foot of the trunk is
  double taper = 0.95;          ///< of all stems
  std::vector<StemRule> stems;  ///< trunk, branches, twigs …
  LeafRule leaves;
  /// Rows of finishes: bark, and as many shades of leaves as follow it.
  std::vector<world::Finish> finishes;
};

/// Grows a tree by the model of Weber and Penn, "Creation and rendering of realistic trees"
/// (SIGGRAPH 1995): stems of each order bend segment by segment, may fork, and bear stems of the
/// next order, whose lengths follow the crown's shape.
/// cost   about 1 ms
Plant grow_tree(const TreeRules& rules, std::uint64_t seed);

}  // namespace terracast::tiler
