#include <fmt/format.h>

#include <algorithm>

#include "validate/checks/checker.h"
#include "validate/sampling.h"

/// Poses as such: rotations are rotations, and the path has no jumps.
namespace terracast::validate {

namespace {

/// The attitude in the middle between two.
Eigen::Matrix3d halfway(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::Vector3d half_turn = 0.5 * rotation_vector(from.transpose() * to);
  if (half_turn.isZero()) return from;
  return from * Eigen::AngleAxisd(half_turn.norm(), half_turn.normalized()).toRotationMatrix();
}

/// How much the step changes at the middle one of three poses, m: in the local frame or in the
/// camera's axes, whichever is less. A turn changes it in the first, a camera that keeps its
/// attitude in the second; a row that is out of order changes both.
double step_change_m(const Pose& before, const Pose& at, const Pose& after) {
  const Eigen::Vector3d first = at.translation - before.translation;
  const Eigen::Vector3d second = after.translation - at.translation;
  const Eigen::Vector3d first_camera = halfway(before.rotation, at.rotation).transpose() * first;
  const Eigen::Vector3d second_camera = halfway(at.rotation, after.rotation).transpose() * second;
  return std::min((second - first).norm(), (second_camera - first_camera).norm());
}

class TrajectoryChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    CheckResult orthonormal;
    orthonormal.name = "trajectory_rotations";
    orthonormal.bound = 1e-6;
    CheckResult jumps;
    jumps.name = "trajectory_jumps";
    jumps.bound = 1.0;
    jumps.unit = "steps";
    CheckResult turns;
    turns.name = "trajectory_turns";
    turns.bound = 90.0;
    turns.unit = "deg";
    std::size_t num_poses = 0, num_steps = 0, num_middles = 0;
    for (const Camera& camera : sequence.cameras) {
      std::vector<double> steps;
      const auto& poses = camera.local_from_camera;
      for (std::size_t i = 0; i < poses.size(); ++i) {
        if (!poses[i]) continue;
        ++num_poses;
        const std::string where = fmt::format("{}, frame {}", camera.name, i);
        const Eigen::Matrix3d& r = poses[i]->rotation;
        double deviation = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
        if (!(r.determinant() > 0.0)) deviation = 2.0;  // a reflection
        note_worst(orthonormal, deviation, where);
        if (i + 1 < poses.size() && poses[i + 1])
          steps.push_back((poses[i + 1]->translation - poses[i]->translation).norm());
      }
      const double typical_m = std::max(median(steps), 1e-9);
      // A camera far out on a body that turns on the spot jumps, and the body does not.
      const Pose camera_from_body =
          camera.body_from_camera ? camera.body_from_camera->inverse() : Pose{};
      for (std::size_t i = 1; i + 1 < poses.size(); ++i) {
        if (!poses[i - 1] || !poses[i] || !poses[i + 1]) continue;
        const std::string where = fmt::format("{}, frame {}", camera.name, i);
        const double of_body_m =
            step_change_m(*poses[i - 1] * camera_from_body, *poses[i] * camera_from_body,
                          *poses[i + 1] * camera_from_body);
        note_worst(
            jumps,
            std::min(of_body_m, step_change_m(*poses[i - 1], *poses[i], *poses[i + 1])) / typical_m,
            where);
        ++num_steps;
      }
      note_turns(poses, camera.name, turns, num_middles);
    }
    orthonormal.summary =
        fmt::format("Largest entry of R R' - I over {} poses; 2 for a reflection.", num_poses);
    orthonormal.reason = "Nine digits leave 1e-8.";
    orthonormal.detects = "a quaternion or matrix row off by 1e-5";
    jumps.summary = fmt::format(
        "Largest of {} changes from one step between frames to the next, in typical (median) "
        "steps; of the camera or of the body that it is mounted on, in the local frame or in its "
        "own axes, whichever is least.",
        num_steps);
    jumps.reason =
        "Flight keeps its step in its own axes, even where it turns by 90 deg a frame; a row that "
        "stands twice makes 2.";
    jumps.detects = "a pose row that stands twice, two rows swapped";
    turns.summary = fmt::format(
        "Largest rotation of {} rows against the middle of their neighbours, where these are less "
        "than 90 deg apart; a row that is more off counts where another, two frames beside, is "
        "not.",
        num_middles);
    turns.reason =
        "A flipped axis turns a row by 180 deg. A right one is 45 deg off the middle where the "
        "turn changes by 90 deg from frame to frame.";
    turns.detects = "an axis flipped in a single row";
    std::vector<CheckResult> results{orthonormal, jumps, turns};
    for (CheckResult& result : results) {
      result.ok = num_poses > 0 && result.value <= result.bound;
      if (num_poses == 0) result.worst = "no poses";
    }
    if (num_poses > 0 && num_steps == 0)
      results[1] = unseen_result(jumps.name, "no camera has poses of three frames in a row");
    if (num_poses > 0 && num_middles == 0)
      results[2] =
          unseen_result(turns.name,
                        "no camera has poses of three frames in a row, the outer ones less "
                        "than 90 deg apart");
    return results;
  }

 private:
  /// By how much a row is turned against the middle of its neighbours, degrees; nothing where these look apart, and have
  /// no middle to speak of.
  static std::optional<double> off_middle_deg(const std::vector<std::optional<Pose>>& poses,
                                              std::size_t i, double bound_deg) {
    if (i < 1 || i + 1 >= poses.size() || !poses[i - 1] || !poses[i] || !poses[i + 1])
      return std::nullopt;
    const Eigen::Matrix3d& before = poses[i - 1]->rotation;
    const Eigen::Matrix3d& after = poses[i + 1]->rotation;
    if (degrees_from_radians(rotation_angle_rad(before.transpose() * after)) > bound_deg)
      return std::nullopt;
    return degrees_from_radians(
        rotation_angle_rad(halfway(before, after).transpose() * poses[i]->rotation));
  }

  /// A camera that turns by half a turn from frame to frame has every row half a turn off: a row that is wrong is
  /// alone in it, so that the nearest others that do not hold it tell.
  static void note_turns(const std::vector<std::optional<Pose>>& poses, const std::string& camera,
                         CheckResult& turns, std::size_t& num_middles) {
    for (std::size_t i = 1; i + 1 < poses.size(); ++i) {
      const std::optional<double> off_deg = off_middle_deg(poses, i, turns.bound);
      if (!off_deg) continue;
      if (*off_deg > turns.bound) {
        // Of rows whose neighbours do not hold this one.
        bool is_any_steady = false;
        for (const std::size_t way : {2U, 3U, 4U})
          for (const std::optional<double> other :
               {i >= way ? off_middle_deg(poses, i - way, turns.bound) : std::nullopt,
                off_middle_deg(poses, i + way, turns.bound)})
            is_any_steady |= other && *other < 0.75 * turns.bound;
        if (!is_any_steady) continue;
      }
      note_worst(turns, *off_deg, fmt::format("{}, frame {}", camera, i));
      ++num_middles;
    }
  }
};

}  // namespace

std::unique_ptr<Checker> make_trajectory_check(const ValidateOptions&) {
  return std::make_unique<TrajectoryChecker>();
}

}  // namespace terracast::validate
