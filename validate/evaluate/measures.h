#pragma once

#include <algorithm>

#include "validate/evaluate/evaluate.h"

/// The measures of single pixels, as their authors define them.
namespace terracast::validate {

/// KITTI 2015 (Menze and Geiger, CVPR 2015; its development kit): an error above 3 px and above 5 %
/// of the true length. At either bound itself it is none.
inline bool is_flow_outlier(double error_px, double truth_px) {
  return error_px > 3.0 && error_px / truth_px > 0.05;
}

/// Eigen, Puhrsch and Fergus (NIPS 2014): the larger ratio of two depths is under a bound.
inline bool is_ratio_under(double depth_m, double truth_m, double bound) {
  return std::max(depth_m / truth_m, truth_m / depth_m) < bound;
}

/// Adds a value to a mean.
inline void add(Sum& sum, double value) {
  sum.total += value;
  ++sum.count;
}
/// Adds a pixel to a share, %.
inline void add_share(Sum& sum, bool is_in) { add(sum, is_in ? 100.0 : 0.0); }

/// Adds a pixel's end-point error to EPE2D (the first sum) and F1-all (the second).
inline void add_flow_error(FrameScore& score, bool is_known, double error_px, double truth_px,
                           MissingPixels missing) {
  if (is_known) add(score.sums[0], error_px);
  if (is_known || missing == MissingPixels::Wrong)
    add_share(score.sums[1], !is_known || is_flow_outlier(error_px, truth_px));
}

}  // namespace terracast::validate
