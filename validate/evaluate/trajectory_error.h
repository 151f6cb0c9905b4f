#pragma once

#include <optional>
#include <span>
#include <vector>

#include "validate/colmap/similarity.h"
#include "validate/evaluate/evaluate.h"
#include "validate/geometry.h"

/// Errors of a trajectory, by Sturm et al. (IROS 2012), translations alone.
namespace terracast::validate {

/// Lays positions on the true ones with the least sum of squares (Umeyama 1991).
/// truth, found  one a frame; only frames that both have count
/// throws        Input: fewer than 3 such frames, or for Sim3 positions that are all one
Similarity align_trajectory(std::span<const std::optional<Pose>> truth,
                            std::span<const std::optional<Pose>> found, Alignment alignment);

struct TrajectoryErrors {
  /// ATE: distance of each laid position from the true one, m.
  std::vector<std::optional<double>> position_m;
  /// RPE: of each frame with `delta` frames later, how far the step in the camera's own frame is
  /// off, m: | R_i^T (q_j - q_i) - s S_i^T (p_j - p_i) |. Gaps are not bridged.
  std::vector<std::optional<double>> step_m;
};
TrajectoryErrors trajectory_errors(std::span<const std::optional<Pose>> truth,
                                   std::span<const std::optional<Pose>> found,
                                   const Similarity& truth_from_found, std::size_t delta);

}  // namespace terracast::validate
