#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "validate/evaluate/evaluate.h"

/// Errors of clouds of points.
namespace terracast::validate {

/// The points that are compared, and what was left out.
struct CroppedClouds {
  std::vector<Eigen::Vector3d> truth, result;
  Eigen::AlignedBox3d bounds = {};  ///< empty: nothing was cropped
  std::int64_t num_truth_outside = 0;
  std::int64_t num_result_outside = 0;
};
/// margin_m  of CloudCrop::Truth: how far beyond the true cloud's bounds points of the result count
CroppedClouds crop_clouds(std::vector<Eigen::Vector3d> truth, std::vector<Eigen::Vector3d> result,
                          CloudCrop crop, double margin_m);

struct CloudErrors {
  std::vector<double> accuracy_m;      ///< of each point of the result from the nearest true one
  std::vector<double> completeness_m;  ///< of each true point from the result's nearest
};
/// truth, result  one point each at least
CloudErrors cloud_errors(std::span<const Eigen::Vector3d> truth,
                         std::span<const Eigen::Vector3d> result);

/// Share of distances of at most `most_m`, %.
double share_within(std::span<const double> distances_m, double most_m);

}  // namespace terracast::validate
