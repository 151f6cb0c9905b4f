#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "validate/frames.h"
#include "validate/transfer.h"

/// Values of images between pixel centres, and the comparison of two views of one surface.
namespace terracast::validate {

/// Value and gradient by the cubic of Catmull and Rom over 4 x 4 pixels: exact for planes, of third
/// order on smooth fields.
struct CubicSample {
  double value = 0.0;
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  ///< a pixel
};

/// Whether 4 x 4 pixels surround an image point.
inline bool has_cubic_support(const core::ImageF& image, const Eigen::Vector2d& pixel) {
  return pixel.x() >= 1.5 && pixel.y() >= 1.5 && pixel.x() < image.width() - 1.5 &&
         pixel.y() < image.height() - 1.5;
}
CubicSample sample_cubic(const core::ImageF& image, const Eigen::Vector2d& pixel);

/// Inverse depth at an image point. On a plane it is linear in the image, so that slanted ground
/// brings no bias.
struct InverseDepthSample {
  CubicSample inverse_depth;  ///< 1/m
  /// Relative: a quarter of the rms second difference over the 4 x 4 pixels.
  double roughness = 0.0;
  double nearest_m = 0.0;  ///< least and greatest depth among the 4 x 4
  double farthest_m = 0.0;
};
/// Roughness up to which an image resolves what it shows. Ground between pixel centres is known to a tenth of
/// that; where leaves, branches or wires are finer than pixels, neighbouring pixels show unlike surfaces, and
/// what lies between their centres does not follow from them.
inline constexpr double kResolvedRoughness = 1e-3;
/// Roughness up to which what an image shows around a pixel counts as smooth: ground, walls, roofs. Fields of grain leave
/// more, and of their points that agree in depth 9 in 100 hide behind a blade that no pixel's centre meets; of those of
/// smooth surroundings 1 in 1000 (a pair of frames over `configs/settled/plains.toml`).
inline constexpr double kSmoothRoughness = 1e-4;

/// Nothing where one of the 4 x 4 pixels has no depth.
std::optional<InverseDepthSample> sample_inverse_depth(const core::ImageF& depth,
                                                       const Eigen::Vector2d& pixel);

/// Whether an image resolves what it shows around a pixel.
inline bool is_resolved(const core::ImageF& depth, int x, int y) {
  const auto sample = sample_inverse_depth(depth, {x + 0.5, y + 0.5});
  return sample && sample->roughness < kResolvedRoughness;
}

/// The Jacobian of pixel_from_point, of a point that is seen: in closed form, and good to nine digits where a lens or
/// a model of any kind is between.
Eigen::Matrix<double, 2, 3> projection_jacobian(const Intrinsics& camera,
                                                const Eigen::Vector3d& point);
/// d point / d pixel, of the point that an image shows at a distance; as exact.
Eigen::Matrix<double, 3, 2> unprojection_jacobian(const Intrinsics& camera,
                                                  const Eigen::Vector2d& pixel, double distance_m);
/// By how many pixels a metre across the line of sight is seen at a distance, in the middle of the image.
double pixels_per_metre(const Intrinsics& camera, double distance_m);

/// Where the image content of `b` stands against where the geometry says: the sub-pixel shift
/// (Lucas and Kanade, with gain and offset free, and with a slope of brightness where the lenses shade) that brings `b`, sampled through depth and poses,
/// onto a 7 x 7 patch of `a`.
struct PatchMatch {
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();  ///< seen minus predicted, in `b`
  double correlation = 0.0;                            ///< zero-mean, normalised, before the shift
  Transfer::Place place;                               ///< of the patch's centre, as predicted
  bool has_converged = false;
  bool is_resolved = true;  ///< by both images around its centre
  /// Whether it lies level, as water does to within what swell and the geoid leave: what it looks like may be what it
  /// mirrors, or its bed, of which depth says nothing.
  bool is_level = false;
  /// How the luma of `a` correlates there with itself one pixel beside, the mean of both ways; 1 where it has no colour.
  /// Noise, and what is finer than pixels, does not at all: what the images of one place have in common is more.
  double own_correlation = 0.0;
};
/// Of its patches.
inline constexpr int kPatchRadius_px = 3;
inline constexpr int kPatchSide_px = 2 * kPatchRadius_px + 1;
inline constexpr int kPatchPixels = kPatchSide_px * kPatchSide_px;

/// returns  nothing where the patch lacks contrast or depth, leaves the image, is hidden, or where
///          the other image shows it half as large again or more, or by as much smaller
std::optional<PatchMatch> match_patch(const View& a, const View& b, int x, int y);
/// The same with a disparity image instead of depth, for a rectified pair.
std::optional<PatchMatch> match_patch_by_disparity(const View& left, const View& right, int x,
                                                   int y);

/// By how much the variance of the mean over patches drawn at random in an image is larger than that over as many
/// independent ones. Patches at an offset (x, y) share (7 - |x|)(7 - |y|) of 49 pixels, and the noise of what they say
/// correlates by that share, which sums to 49 over all offsets: each correlates with itself by 1 and with the n - 1
/// others by (n - 1) 49 / (pixels of the image), but for those at its border.
inline double patches_per_fact(std::size_t num_patches, int width_px, int height_px) {
  return 1.0 + (static_cast<double>(num_patches) - 1.0) * kPatchPixels /
                   (static_cast<double>(width_px) * height_px);
}

/// Median of values (their order is changed); 0 of none. NaN is larger than any number.
template <class Value>
double median(std::vector<Value>& values) {
  if (values.empty()) return 0.0;
  const auto numbers_end = std::partition(values.begin(), values.end(),
                                          [](const Value& value) { return !std::isnan(value); });
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  if (middle < numbers_end) std::nth_element(values.begin(), middle, numbers_end);
  return static_cast<double>(*middle);
}
/// A median, and what it may be off by.
struct MedianEstimate {
  double median = 0.0;
  /// The median of all that could be measured lies so near but with a probability of kFalseVerdict, however values
  /// scatter: of n values a binomial number lies below it, n/2 with a standard error of sqrt(n)/2, so that it lies
  /// between the values of the ranks n/2 - 6.1 sqrt(n)/2 and n/2 + 6.1 sqrt(n)/2. +inf: too few values.
  double unsure = 0.0;

  bool tells(double bound) const { return unsure < bound; }
  /// The part of its size that is sure.
  double judged() const { return std::max(0.0, std::abs(median) - unsure); }
};
/// Of values without NaN; their order is changed.
/// values_per_fact   as many of them as are worth one that is independent of the others
MedianEstimate estimate_median(std::vector<double>& values, double values_per_fact = 1.0);

template <class Value>
double quantile(std::vector<Value>& values, double share) {
  if (values.empty()) return 0.0;
  const auto index = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + index, values.end());
  return static_cast<double>(values[static_cast<std::size_t>(index)]);
}

}  // namespace terracast::validate
