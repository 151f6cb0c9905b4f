#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "validate/colmap/similarity.h"
#include "validate/evaluate/evaluate.h"
#include "validate/geometry.h"

/// Errors of a trajectory: positions and steps by Sturm et al. (IROS 2012), drift by Geiger et al.
/// (CVPR 2012).
namespace terracast::validate {

/// One pose a frame, or a time; nothing where there is none.
using PosePath = std::span<const std::optional<Pose>>;

/// Lays positions on the true ones with the least sum of squares (Umeyama 1991; Yaw: a turn about
/// the third axis and a shift).
/// truth, found  one a frame; only frames that both have count
/// throws        Input: fewer than 3 such frames, or for Sim3 positions that are all one
Similarity align_trajectory(PosePath truth, PosePath found, Alignment alignment);

/// By how much Sim3 would scale the result; nullopt: fewer than 3 frames, or positions all one.
std::optional<double> scale_of(PosePath truth, PosePath found);

/// The frame at which the step from each frame ends; nullopt: none.
using StepEnds = std::vector<std::optional<std::size_t>>;
StepEnds steps_of_frames(std::size_t num_frames, std::size_t delta);
/// The first frame more than `length_m` farther along the true path, as KITTI's development kit takes it.
StepEnds steps_of_length(std::span<const double> path_m, double length_m);

/// Length of the true path up to each frame, m, straight from pose to pose.
std::vector<double> path_lengths_m(PosePath truth);
/// The same up to each time: between two frames in proportion to time, 0 before the first, all of it
/// after the last.
/// frame_times_s  as many as frames, increasing
std::vector<double> path_lengths_at_m(PosePath frames, std::span<const double> frame_times_s,
                                      std::span<const double> times_s);

struct TrajectoryErrors {
  /// ATE: distance of each laid position from the true one, m.
  std::vector<std::optional<double>> position_m;
  /// RPE: how far the step from a frame is off in the camera's own frame, m:
  /// | R_i^T (q_j - q_i) - s S_i^T (p_j - p_i) |. Gaps are not bridged.
  std::vector<std::optional<double>> step_m;
  /// The angle of (R_i^T R_j)^T S_i^T S_j, deg.
  std::vector<std::optional<double>> step_deg;
};
TrajectoryErrors trajectory_errors(PosePath truth, PosePath found,
                                   const Similarity& truth_from_found, const StepEnds& ends);
/// Of steps of `delta` frames.
TrajectoryErrors trajectory_errors(PosePath truth, PosePath found,
                                   const Similarity& truth_from_found, std::size_t delta);

/// KITTI odometry's error of a part of the path.
struct DriftSegment {
  std::size_t first = 0;
  std::size_t length_index = 0;
  double translation_m = 0.0;
  double rotation_deg = 0.0;
  double duration_s = 0.0;
};

struct Drift {
  std::vector<DriftSegment> segments;  ///< by first frame, then length
  std::int64_t num_lost = 0;           ///< segments of which the result lacks an end
  std::int64_t num_unjudged = 0;       ///< segments of which the truth lacks an end
};

/// Segments of each length from every `stride`-th frame.
/// found      no alignment but its scale changes the figures
/// times_s    one a frame
/// path_m     length of the true path up to each frame
Drift drift_of(PosePath truth, PosePath found, double scale, std::span<const double> times_s,
               std::span<const double> path_m, std::span<const double> lengths_m,
               std::size_t stride);

}  // namespace terracast::validate
