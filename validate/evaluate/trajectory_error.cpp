#include "validate/evaluate/trajectory_error.h"

#include <Eigen/Geometry>

#include "core/error.h"

namespace terracast::validate {

using core::ErrorKind;
using core::fail;

Similarity align_trajectory(std::span<const std::optional<Pose>> truth,
                            std::span<const std::optional<Pose>> found, Alignment alignment) {
  TERRACAST_CHECK(truth.size() == found.size());
  if (alignment == Alignment::None) return {};
  std::vector<Eigen::Vector3d> is, says;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!truth[i] || !found[i]) continue;
    is.push_back(truth[i]->translation);
    says.push_back(found[i]->translation);
  }
  constexpr std::size_t kLeastPoses = 3;
  if (says.size() < kLeastPoses)
    fail(ErrorKind::Input, "{} poses can be compared; {} are needed to lay one on the other",
         says.size(), kLeastPoses);
  const auto columns = [](const std::vector<Eigen::Vector3d>& list) {
    Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(list.size()));
    for (std::size_t i = 0; i < list.size(); ++i)
      matrix.col(static_cast<Eigen::Index>(i)) = list[i];
    return matrix;
  };
  const Eigen::Matrix3Xd points = columns(says);
  const Eigen::Matrix3Xd targets = columns(is);
  // What subtracting the mean leaves of rounding is no extent.
  const auto is_one_place = [](const Eigen::Matrix3Xd& places) {
    return !((places.colwise() - places.rowwise().mean()).norm() > 1e-12 * places.norm());
  };
  if (alignment == Alignment::Sim3 && (is_one_place(points) || is_one_place(targets)))
    fail(ErrorKind::Input,
         "the {} positions are all one: no scale follows from them; --align se3 or none is right",
         is_one_place(points) ? "result's" : "true");
  const Eigen::Matrix4d all = Eigen::umeyama(points, targets, alignment == Alignment::Sim3);
  Similarity similarity;
  if (alignment == Alignment::Sim3)
    similarity.scale = std::cbrt(all.topLeftCorner<3, 3>().determinant());
  similarity.rotation = all.topLeftCorner<3, 3>() / similarity.scale;
  similarity.translation = all.topRightCorner<3, 1>();
  return similarity;
}

TrajectoryErrors trajectory_errors(std::span<const std::optional<Pose>> truth,
                                   std::span<const std::optional<Pose>> found,
                                   const Similarity& truth_from_found, std::size_t delta) {
  TERRACAST_CHECK(truth.size() == found.size() && delta > 0);
  TrajectoryErrors errors;
  errors.position_m.resize(truth.size());
  errors.step_m.resize(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!truth[i] || !found[i]) continue;
    errors.position_m[i] =
        (truth_from_found * found[i]->translation - truth[i]->translation).norm();
    const std::size_t j = i + delta;
    if (j >= truth.size() || !truth[j] || !found[j]) continue;
    const Eigen::Vector3d is =
        truth[i]->rotation.transpose() * (truth[j]->translation - truth[i]->translation);
    const Eigen::Vector3d says =
        truth_from_found.scale *
        (found[i]->rotation.transpose() * (found[j]->translation - found[i]->translation));
    errors.step_m[i] = (says - is).norm();
  }
  return errors;
}

}  // namespace terracast::validate
