#include "validate/evaluate/cloud_error.h"

#include <algorithm>

#include "validate/oracle/nearest_points.h"

namespace terracast::validate {

namespace {

Eigen::AlignedBox3d bounds_of(std::span<const Eigen::Vector3d> points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  return box;
}

/// Keeps the points within a box.
/// returns  how many were not
std::int64_t keep_within(const Eigen::AlignedBox3d& box, std::vector<Eigen::Vector3d>& points) {
  return static_cast<std::int64_t>(
      std::erase_if(points, [&](const Eigen::Vector3d& point) { return !box.contains(point); }));
}

}  // namespace

CroppedClouds crop_clouds(std::vector<Eigen::Vector3d> truth, std::vector<Eigen::Vector3d> result,
                          CloudCrop crop, double margin_m) {
  CroppedClouds clouds{.truth = std::move(truth), .result = std::move(result)};
  if (crop == CloudCrop::None) return clouds;
  clouds.bounds = bounds_of(clouds.truth);
  if (crop == CloudCrop::Common) {
    clouds.bounds.clamp(bounds_of(clouds.result));
    clouds.num_truth_outside = keep_within(clouds.bounds, clouds.truth);
  } else if (!clouds.bounds.isEmpty()) {
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(margin_m);
    clouds.bounds = Eigen::AlignedBox3d(clouds.bounds.min() - margin, clouds.bounds.max() + margin);
  }
  clouds.num_result_outside = keep_within(clouds.bounds, clouds.result);
  return clouds;
}

CloudErrors cloud_errors(std::span<const Eigen::Vector3d> truth,
                         std::span<const Eigen::Vector3d> result) {
  return {.accuracy_m = nearest_distances_m(truth, result),
          .completeness_m = nearest_distances_m(result, truth)};
}

double share_within(std::span<const double> distances_m, double most_m) {
  const auto count = std::count_if(distances_m.begin(), distances_m.end(),
                                   [&](double distance_m) { return distance_m <= most_m; });
  return 100.0 * static_cast<double>(count) / static_cast<double>(distances_m.size());
}

}  // namespace terracast::validate
