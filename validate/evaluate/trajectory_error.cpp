#include "validate/evaluate/trajectory_error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace terracast::validate {

using core::ErrorKind;
using core::fail;

namespace {

/// Positions of the frames that truth and result both have, one a column.
struct CommonPositions {
  Eigen::Matrix3Xd truth, found;
};

CommonPositions common_positions(PosePath truth, PosePath found) {
  TERRACAST_CHECK(truth.size() == found.size());
  Eigen::Index count = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    if (truth[i] && found[i]) ++count;
  CommonPositions common{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count)};
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!truth[i] || !found[i]) continue;
    common.truth.col(column) = truth[i]->translation;
    common.found.col(column++) = found[i]->translation;
  }
  return common;
}

constexpr Eigen::Index kLeastPoses = 3;

/// Subtracting the mean leaves rounding, which is no extent.
bool is_one_place(const Eigen::Matrix3Xd& places) {
  return !((places.colwise() - places.rowwise().mean()).norm() > 1e-12 * places.norm());
}

Similarity umeyama(const CommonPositions& common, bool with_scale) {
  const Eigen::Matrix4d all = Eigen::umeyama(common.found, common.truth, with_scale);
  Similarity similarity;
  if (with_scale) similarity.scale = std::cbrt(all.topLeftCorner<3, 3>().determinant());
  similarity.rotation = all.topLeftCorner<3, 3>() / similarity.scale;
  similarity.translation = all.topRightCorner<3, 1>();
  return similarity;
}

/// The turn about the third axis that leaves the least sum of squares: its derivative is 0 where
/// tan = sum of cross products / sum of dot products.
Similarity yaw_alignment(const CommonPositions& common) {
  const Eigen::Vector3d mean = common.found.rowwise().mean();
  const Eigen::Vector3d target = common.truth.rowwise().mean();
  double cross = 0.0, dot = 0.0;
  for (Eigen::Index i = 0; i < common.found.cols(); ++i) {
    const Eigen::Vector3d p = common.found.col(i) - mean, q = common.truth.col(i) - target;
    cross += p.x() * q.y() - p.y() * q.x();
    dot += p.x() * q.x() + p.y() * q.y();
  }
  Similarity similarity;
  similarity.rotation =
      Eigen::AngleAxisd(std::atan2(cross, dot), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  similarity.translation = target - similarity.rotation * mean;
  return similarity;
}

struct StepError {
  double translation_m = 0.0;
  double rotation_deg = 0.0;
};

StepError step_error(PosePath truth, PosePath found, double scale, std::size_t i, std::size_t j) {
  const Eigen::Vector3d is =
      truth[i]->rotation.transpose() * (truth[j]->translation - truth[i]->translation);
  const Eigen::Vector3d says =
      scale * (found[i]->rotation.transpose() * (found[j]->translation - found[i]->translation));
  const Eigen::Matrix3d turn = (truth[i]->rotation.transpose() * truth[j]->rotation).transpose() *
                               (found[i]->rotation.transpose() * found[j]->rotation);
  // Of atan2, as the arc cosine of a trace loses angles under 1e-8 rad.
  const Eigen::Vector3d axis(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0),
                             turn(1, 0) - turn(0, 1));
  return {(says - is).norm(),
          std::atan2(axis.norm(), turn.trace() - 1.0) * (180.0 / std::numbers::pi)};
}

}  // namespace

Similarity align_trajectory(PosePath truth, PosePath found, Alignment alignment) {
  if (alignment == Alignment::None) return {};
  const CommonPositions common = common_positions(truth, found);
  if (common.found.cols() < kLeastPoses)
    fail(ErrorKind::Input, "{} poses can be compared; {} are needed to lay one on the other",
         common.found.cols(), kLeastPoses);
  if (alignment == Alignment::Yaw) return yaw_alignment(common);
  if (alignment == Alignment::Sim3 && (is_one_place(common.found) || is_one_place(common.truth)))
    fail(ErrorKind::Input,
         "the {} positions are all one: no scale follows from them; --align se3 or none is right",
         is_one_place(common.found) ? "result's" : "true");
  return umeyama(common, alignment == Alignment::Sim3);
}

std::optional<double> scale_of(PosePath truth, PosePath found) {
  const CommonPositions common = common_positions(truth, found);
  if (common.found.cols() < kLeastPoses || is_one_place(common.found) || is_one_place(common.truth))
    return std::nullopt;
  return umeyama(common, true).scale;
}

StepEnds steps_of_frames(std::size_t num_frames, std::size_t delta) {
  TERRACAST_CHECK(delta > 0);
  StepEnds ends(num_frames);
  for (std::size_t i = 0; i < num_frames && delta < num_frames - i; ++i) ends[i] = i + delta;
  return ends;
}

StepEnds steps_of_length(std::span<const double> path_m, double length_m) {
  StepEnds ends(path_m.size());
  for (std::size_t i = 0; i < path_m.size(); ++i) {
    const auto end = std::upper_bound(path_m.begin() + static_cast<std::ptrdiff_t>(i), path_m.end(),
                                      path_m[i] + length_m);
    if (end != path_m.end()) ends[i] = static_cast<std::size_t>(end - path_m.begin());
  }
  return ends;
}

std::vector<double> path_lengths_m(PosePath truth) {
  std::vector<double> lengths(truth.size());
  double length_m = 0.0;
  const Pose* last = nullptr;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i]) {
      if (last != nullptr) length_m += (truth[i]->translation - last->translation).norm();
      last = &*truth[i];
    }
    lengths[i] = length_m;
  }
  return lengths;
}

std::vector<double> path_lengths_at_m(PosePath frames, std::span<const double> frame_times_s,
                                      std::span<const double> times_s) {
  TERRACAST_CHECK(!frames.empty() && frames.size() == frame_times_s.size());
  const std::vector<double> path_m = path_lengths_m(frames);
  std::vector<double> lengths_m;
  for (const double time_s : times_s) {
    const auto next = static_cast<std::size_t>(
        std::upper_bound(frame_times_s.begin(), frame_times_s.end(), time_s) -
        frame_times_s.begin());
    if (next == 0 || next == frames.size()) {
      lengths_m.push_back(next == 0 ? 0.0 : path_m.back());
      continue;
    }
    const double share =
        (time_s - frame_times_s[next - 1]) / (frame_times_s[next] - frame_times_s[next - 1]);
    lengths_m.push_back(std::lerp(path_m[next - 1], path_m[next], share));
  }
  return lengths_m;
}

TrajectoryErrors trajectory_errors(PosePath truth, PosePath found,
                                   const Similarity& truth_from_found, const StepEnds& ends) {
  TERRACAST_CHECK(truth.size() == found.size() && truth.size() == ends.size());
  TrajectoryErrors errors;
  errors.position_m.resize(truth.size());
  errors.step_m.resize(truth.size());
  errors.step_deg.resize(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!truth[i] || !found[i]) continue;
    errors.position_m[i] =
        (truth_from_found * found[i]->translation - truth[i]->translation).norm();
    if (!ends[i] || !truth[*ends[i]] || !found[*ends[i]]) continue;
    const StepError step = step_error(truth, found, truth_from_found.scale, i, *ends[i]);
    errors.step_m[i] = step.translation_m;
    errors.step_deg[i] = step.rotation_deg;
  }
  return errors;
}

TrajectoryErrors trajectory_errors(PosePath truth, PosePath found,
                                   const Similarity& truth_from_found, std::size_t delta) {
  return trajectory_errors(truth, found, truth_from_found, steps_of_frames(truth.size(), delta));
}

Drift drift_of(PosePath truth, PosePath found, double scale, std::span<const double> times_s,
               std::span<const double> path_m, std::span<const double> lengths_m,
               std::size_t stride) {
  TERRACAST_CHECK(truth.size() == found.size() && truth.size() == times_s.size() &&
                  truth.size() == path_m.size() && stride > 0);
  std::vector<StepEnds> ends;
  for (const double length_m : lengths_m) ends.push_back(steps_of_length(path_m, length_m));
  Drift drift;
  for (std::size_t i = 0; i < truth.size(); i += stride)
    for (std::size_t k = 0; k < ends.size(); ++k) {
      if (!ends[k][i]) continue;
      const std::size_t j = *ends[k][i];
      if (!truth[i] || !truth[j]) {
        ++drift.num_unjudged;
        continue;
      }
      if (!found[i] || !found[j]) {
        ++drift.num_lost;
        continue;
      }
      const StepError error = step_error(truth, found, scale, i, j);
      drift.segments.push_back(
          {i, k, error.translation_m, error.rotation_deg, times_s[j] - times_s[i]});
    }
  return drift;
}

}  // namespace terracast::validate
