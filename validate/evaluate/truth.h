#pragma once

#include "core/image.h"
#include "validate/evaluate/task.h"

/// What a dataset says of one image, as far as it can judge a result.
namespace terracast::validate {

/// Whether the dataset holds what the truth of a frame is made of: depth; for flow also what the
/// format stores, or both poses.
bool has_depth_truth(const Subject& subject, int frame);
bool has_flow_truth(const Subject& subject, int frame);
bool has_scene_flow_truth(const Subject& subject, int frame);

/// Planar depth, m; NaN where nothing is (sky).
/// throws  Input: damaged
core::ImageF depth_truth(const Subject& subject, int frame);

struct FlowTruth {
  core::ImageF depth;  ///< planar, m; NaN: none
  core::ImageF flow;   ///< 2 channels, px, to the next frame; NaN: none
};

/// The format's own flow where it stores one, else where depth and poses carry each pixel's centre,
/// which holds for what stands still. NaN where there is no depth, where the point is not before the
/// next camera, and where the mask leaves it out.
/// throws  Input: damaged; Covisible of a format that stores no such mask
FlowTruth flow_truth(const Subject& subject, int frame, FlowMask mask);

/// A point of each pixel in the camera's frame of now, and of the next frame in the camera's frame
/// of then (x right, y down, z forward); by depth and poses.
struct SceneFlowTruth {
  FlowTruth image;
  core::Image<double> points;       ///< 3 channels, m; NaN: none
  core::Image<double> points_next;  ///< the same points
  /// Pixels whose stored flow is not that of a point that stands still: they are left out.
  std::int64_t num_moving = 0;
};
SceneFlowTruth scene_flow_truth(const Subject& subject, int frame, FlowMask mask);

/// A pixel of 2 channels.
inline Eigen::Vector2d vector_at(const core::ImageF& image, int x, int y) {
  return {static_cast<double>(image(x, y, 0)), static_cast<double>(image(x, y, 1))};
}

/// Whether a pixel of the truth counts: it has flow, and depth and flow are within the limits (RAFT-3D,
/// Teed and Deng, CVPR 2021: below 250 m and 250 px).
bool is_judged(const FlowTruth& truth, int x, int y, const EvaluateOptions& options);
std::vector<std::string> flow_terms(const EvaluateOptions& options);

/// Focal length times baseline of the pair, px m: depth times disparity.
/// throws  Input: the subject is not the left camera of a pair
double focal_times_baseline(const Subject& subject);

/// A subject's intrinsics.
/// throws  Input: intrinsics that are none
const Intrinsics& sound_intrinsics(const Subject& subject);

}  // namespace terracast::validate
