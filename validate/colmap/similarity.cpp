#include "validate/colmap/similarity.h"

#include <Eigen/Geometry>

#include "core/error.h"

namespace terracast::validate {

Similarity best_similarity(std::span<const Eigen::Vector3d> points,
                           std::span<const Eigen::Vector3d> targets) {
  TERRACAST_CHECK(points.size() == targets.size() && points.size() >= 2);
  const auto columns = [](std::span<const Eigen::Vector3d> list) {
    Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(list.size()));
    for (std::size_t i = 0; i < list.size(); ++i)
      matrix.col(static_cast<Eigen::Index>(i)) = list[i];
    return matrix;
  };
  const Eigen::Matrix4d all = Eigen::umeyama(columns(points), columns(targets), true);
  Similarity similarity;
  similarity.scale = std::cbrt(all.topLeftCorner<3, 3>().determinant());
  similarity.rotation = all.topLeftCorner<3, 3>() / similarity.scale;
  similarity.translation = all.topRightCorner<3, 1>();
  return similarity;
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace terracast::validate
