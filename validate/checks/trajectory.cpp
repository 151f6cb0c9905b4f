#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "validate/checks/checker.h"
#include "validate/checks/single_rows.h"
#include "validate/sampling.h"

/// Poses as such: rotations are rotations, and the path has no jumps.
namespace terracast::validate {

namespace {

class TrajectoryChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    CheckResult orthonormal;
    orthonormal.name = "trajectory_rotations";
    orthonormal.bound = 1e-6;
    CheckResult turns;
    turns.name = "trajectory_turns";
    turns.bound = 90.0;
    turns.unit = "deg";
    std::size_t num_poses = 0, num_middles = 0;
    for (const Camera& camera : sequence.cameras) {
      const auto& poses = camera.local_from_camera;
      for (std::size_t i = 0; i < poses.size(); ++i) {
        if (!poses[i]) continue;
        ++num_poses;
        const std::string where = fmt::format("{}, frame {}", camera.name, i);
        const Eigen::Matrix3d& r = poses[i]->rotation;
        double deviation = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
        if (!(r.determinant() > 0.0)) deviation = 2.0;  // a reflection
        note_worst(orthonormal, deviation, where);
      }
      note_turns(poses, camera.name, turns, num_middles);
    }
    orthonormal.summary =
        fmt::format("Largest entry of R R' - I over {} poses; 2 for a reflection.", num_poses);
    orthonormal.reason = "Nine digits leave 1e-8.";
    orthonormal.detects = "a quaternion or matrix row off by 1e-5";
    turns.summary = fmt::format(
        "Largest rotation of {} rows against the middle of their neighbours, where these are less "
        "than 90 deg apart; a row that is more off counts where another, two frames beside, is "
        "not.",
        num_middles);
    turns.reason =
        "A flipped axis turns a row by 180 deg. A right one is 45 deg off the middle where the "
        "turn changes by 90 deg from frame to frame.";
    turns.detects = "an axis flipped in a single row";
    std::vector<CheckResult> results{orthonormal, turns};
    for (CheckResult& result : results) {
      result.ok = num_poses > 0 && result.value <= result.bound;
      if (num_poses == 0) result.worst = "no poses";
    }
    if (num_poses > 0 && num_middles == 0)
      results[1] =
          unseen_result(turns.name,
                        "no camera has poses of three frames in a row, the outer ones less "
                        "than 90 deg apart");
    results.insert(results.begin() + 1, jumps_result(sequence));
    return results;
  }

 private:
  static CheckResult jumps_result(const Sequence& sequence) {
    CheckResult jumps;
    jumps.name = "trajectory_jumps";
    jumps.bound = kOddRow_steps;
    jumps.unit = "steps";
    std::size_t num_rows = 0;
    std::vector<std::string> unsteady;
    for (const Camera& camera : sequence.cameras) {
      const auto& poses = camera.local_from_camera;
      SingleRows rows = find_single_rows(poses);
      // A camera far out on a body that turns on the spot jumps, and the body does not.
      if (camera.body_from_camera) {
        std::vector<std::optional<Pose>> of_body = poses;
        for (std::optional<Pose>& pose : of_body)
          if (pose) pose = *pose * camera.body_from_camera->inverse();
        const SingleRows rows_of_body = find_single_rows(of_body);
        if (std::pair(rows_of_body.is_spoilt, rows_of_body.farthest.steps) <
            std::pair(rows.is_spoilt, rows.farthest.steps))
          rows = rows_of_body;
      }
      constexpr std::size_t kEnough = 3;
      if (rows.num_rows < kEnough) continue;
      const std::string where = fmt::format("{}, frame {}", camera.name, rows.farthest.row);
      if (rows.farthest.steps > jumps.bound && !rows.is_spoilt) {
        unsteady.push_back(where);
        continue;
      }
      num_rows += rows.num_rows;
      note_worst(jumps, rows.farthest.steps, where);
    }
    if (num_rows == 0 && unsteady.empty())
      return unseen_result(jumps.name,
                           "no camera has poses of five frames, three of them beside two others");
    jumps.ok = jumps.is_within_bound();
    if (jumps.ok && !unsteady.empty()) {
      jumps.is_unseen = jumps.skipped = jumps.is_of_all = true;
      jumps.worst = fmt::format(
          "{}: the path starts, stops or turns so suddenly between frames, or leaps so often, that "
          "a "
          "single wrong row would not stand out",
          fmt::join(unsteady, "; "));
    }
    jumps.summary = fmt::format(
        "Farthest of {} rows from where the two before and the two after it put it, in steps; of "
        "the camera or of the body that it is mounted on, in the local frame or in its own axes, "
        "whichever is least.",
        num_rows);
    jumps.reason =
        "On a path that is steady but for one row a row that stands twice is a whole step off, and "
        "two that changed places 5/6 of one. Where a body hovers, starts or stops nothing is "
        "called wrong.";
    jumps.detects = "a pose row that stands twice, two rows swapped";
    return jumps;
  }

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
