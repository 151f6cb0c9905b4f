#pragma once

#include <span>
#include <vector>

#include "validate/geometry.h"

namespace terracast::validate {

/// target = scale * rotation * source + translation.
struct Similarity {
  double scale = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
};

/// The similarity that brings points to their targets with the least sum of squares (Umeyama 1991).
/// points   as many as targets, 2 or more; on a line the turn about it is left open
Similarity best_similarity(std::span<const Eigen::Vector3d> points,
                           std::span<const Eigen::Vector3d> targets);

/// sqrt of the mean of squares.
double root_mean_square(const std::vector<double>& values);

}  // namespace terracast::validate
