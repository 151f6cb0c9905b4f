#include "geo/satellites/satellite_geometry.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace terracast::geo {

DilutionOfPrecision dilution_of_precision(std::span<const Eigen::Vector3d> directions_enu) {
  constexpr double kOpen = std::numeric_limits<double>::infinity();
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  for (const Eigen::Vector3d& direction : directions_enu) {
    const Eigen::Vector4d row(-direction.x(), -direction.y(), -direction.z(), 1.0);
    normal += row * row.transpose();
  }
  const Eigen::FullPivLU<Eigen::Matrix4d> parts(normal);
  if (directions_enu.size() < 4 || !parts.isInvertible()) return {kOpen, kOpen, kOpen, kOpen};
  const Eigen::Vector4d variances = parts.inverse().diagonal();
  if (!(variances.minCoeff() > 0.0)) return {kOpen, kOpen, kOpen, kOpen};
  return {.horizontal = std::sqrt(variances[0] + variances[1]),
          .vertical = std::sqrt(variances[2]),
          .position = std::sqrt(variances[0] + variances[1] + variances[2]),
          .time = std::sqrt(variances[3])};
}

}  // namespace terracast::geo
