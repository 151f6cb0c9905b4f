#pragma once

#include <optional>
#include <string>
#include <vector>

#include "validate/dataset.h"

/// Rows of poses that do not belong where they stand: one that stands twice, two that changed places.
namespace terracast::validate {

/// How far one row is from where the two before and the two after it put it, in steps: by a cubic through these, or at the
/// second row and the last but one by a parabola through three. Steps are taken in the local frame or along the row's own axes,
/// whichever leaves less, so that a turn is none.
///
/// A step is the longest one beside the row, or the path's median one where that is longer. A body that keeps its
/// direction, and whose steps are between 0 and that, leaves 2/3 at most, however suddenly it starts and stops. On a
/// steady path a row that stands twice leaves 1, two exchanged leave 5/6.
struct OddRow {
  std::size_t row = 0;
  double steps = 0.0;
};

/// Whether a single row spoils a path that is steady without it.
struct SingleRows {
  OddRow farthest;
  std::size_t num_rows = 0;  ///< that could be compared
  /// By that row: without it, or with it and its neighbour exchanged, the others fit; or by the leap to it.
  bool is_spoilt = false;
};

/// The farthest row is beyond this in a path that it spoils.
inline constexpr double kOddRow_steps = 0.75;

/// Of rows with at least two others on one side and one on the other; a path of fewer than five tells nothing.
SingleRows find_single_rows(const std::vector<std::optional<Pose>>& poses);

}  // namespace terracast::validate
