#pragma once

#include <optional>
#include <vector>

#include "validate/geometry.h"

/// How well a bundle of images tells whether its scale drifts.
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
};

/// How far errors of observations let the drift be off: the sum over the views of weight times the
/// mean logarithm of their points' depths.
struct DriftError {
  /// Standard error where each coordinate of each observation errs for itself by 1 px, relative.
  double per_px = 0.0;
  /// By how much they do err: residuals over the adjustment's degrees of freedom, px.
  double noise_px = 0.0;
};

/// The first-order covariance of the adjustment, gauge removed (Triggs et al., "Bundle Adjustment: A
/// Modern Synthesis", 2000). Derivatives of projections are central differences, good to 1e-6 of
/// themselves. Points with fewer than two observations in front of their cameras are left out.
/// returns  nothing where the views do not hang together, one in the drift sees no point, there are
///          no more observations than unknowns, or more views than kMostDriftViews
/// cost     (6 views)^3 / 3 operations and (6 views)^2 numbers: 0.3 GB for 1000 views
std::optional<DriftError> drift_error(const Bundle& bundle);

inline constexpr std::size_t kMostDriftViews = 1000;

}  // namespace terracast::validate
