#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "validate/geometry.h"

/// How well a bundle of images tells its poses, and how well its poses explain its images.
namespace terracast::validate {

/// An image of a bundle.
struct BundleView {
  struct Observation {
    std::size_t point = 0;  ///< index in Bundle::points
    Eigen::Vector2d pixel;
  };
  const Intrinsics* camera = nullptr;
  Pose camera_from_bundle;
  std::vector<Observation> observations;
  /// In the drift: above 0 the image is one of the first, below one of the last, 0 neither. Those of
  /// a bundle come to 0 in sum, so that no change of the bundle's own scale is a drift.
  double weight = 0.0;
};

/// What an adjustment of poses and points made of images with known intrinsics.
struct Bundle {
  std::vector<BundleView> views;
  std::vector<Eigen::Vector3d> points;
  /// Indices of views of which one is the next frame of the other's camera.
  std::vector<std::pair<std::size_t, std::size_t>> steps = {};
};

/// Standard errors of an adjustment where each coordinate of each observation errs for itself by 1 px.
struct BundleErrors {
  /// By how much they do err: residuals over the adjustment's degrees of freedom, px.
  double noise_px = 0.0;
  /// Of the drift: the sum over the views of weight times the mean logarithm of their points' depths. Nothing where
  /// no view is in it, or one that is sees no point.
  std::optional<double> drift = {};
  double position =
      0.0;            ///< of the cameras' centres after the best similarity, rms; the bundle's unit
  double step = 0.0;  ///< of the way along a step after the same similarity, rms; the bundle's unit
  double turn_px = 0.0;  ///< of the turn along a step, times the focal length, rms
};

/// Leaves the views out that share too few points with others to have a pose by them: those with fewer than three points
/// that another view sees. Steps to and from them are left out too.
/// returns  how many are left out
std::size_t drop_lonely_views(Bundle& bundle);

/// The first-order covariance of the adjustment, gauge removed (Triggs et al., "Bundle Adjustment: A
/// Modern Synthesis", 2000). Derivatives of projections are central differences, good to 1e-6 of
/// themselves. Points with fewer than two observations in front of their cameras are left out.
/// returns  nothing where the views do not hang together, there are no more observations than unknowns, or more
///          views than kMostBundleViews
/// cost     (6 views)^3 operations and 6 (6 views)^2 numbers: 1.7 GB for 1000 views
std::optional<BundleErrors> bundle_errors(const Bundle& bundle);

inline constexpr std::size_t kMostBundleViews = 1000;

/// Errors of keypoints on like ground are alike: figures of right datasets are up to so many times as far off as if
/// each keypoint erred for itself (docs/validate.md).
inline constexpr double kAlikeErrors = 8.0;

/// Puts each point of two observations and more where the views that see it have it: where their rays meet nearest,
/// then adjusted, with errors beyond a pixel weighed by their size and not by its square.
void triangulate(Bundle& bundle);

/// How a bundle explains its observations, by view: the sums of squared distances from the points' projections, each
/// cut at kMostResidual_px (COLMAP's own limit), px^2.
std::vector<double> explain(const Bundle& bundle);
inline constexpr double kMostResidual_px = 4.0;

/// What an adjustment of poses and points would make of a bundle, to first order.
struct Improvement {
  double noise_px = 0.0;   ///< residuals that it leaves, a coordinate, over the degrees of freedom
  double moved_px = 0.0;   ///< what it takes away, rms over the observations
  double unsure_px = 0.0;  ///< the same where observations err by that noise, each for itself
};
/// returns  nothing where bundle_errors() gives nothing
std::optional<Improvement> improvement(const Bundle& bundle);

/// The standard errors of a bundle's points at fixed poses along given directions, for observations that err by 1 px;
/// +inf for points with fewer than two observations.
/// directions   one a point, of length 1
std::vector<double> point_errors(const Bundle& bundle,
                                 const std::vector<Eigen::Vector3d>& directions);

}  // namespace terracast::validate
