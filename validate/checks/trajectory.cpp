#include <fmt/format.h>

#include "validate/checks/checker.h"
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
    CheckResult jumps;
    jumps.name = "trajectory_jumps";
    jumps.bound = 1.0;
    jumps.unit = "steps";
    CheckResult turns;
    turns.name = "trajectory_turns";
    turns.bound = 30.0;
    turns.unit = "deg";
    std::size_t num_poses = 0;
    for (const Camera& camera : sequence.cameras) {
      std::vector<double> steps;
      const auto& poses = camera.local_from_camera;
      const auto step_at = [&](std::size_t i) {
        return (poses[i + 1]->translation - poses[i]->translation).eval();
      };
      for (std::size_t i = 0; i < poses.size(); ++i) {
        if (!poses[i]) continue;
        ++num_poses;
        const std::string where = fmt::format("{}, frame {}", camera.name, i);
        const Eigen::Matrix3d& r = poses[i]->rotation;
        double deviation = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
        if (!(r.determinant() > 0.0)) deviation = 2.0;  // a reflection
        note_worst(orthonormal, deviation, where);
        if (i + 1 < poses.size() && poses[i + 1]) steps.push_back(step_at(i).norm());
      }
      const double typical_m = std::max(median(steps), 1e-9);
      for (std::size_t i = 1; i + 1 < poses.size(); ++i) {
        if (!poses[i - 1] || !poses[i] || !poses[i + 1]) continue;
        const std::string where = fmt::format("{}, frame {}", camera.name, i);
        note_worst(jumps, (step_at(i) - step_at(i - 1)).norm() / typical_m, where);
        const Eigen::Vector3d before =
            rotation_vector(poses[i - 1]->rotation.transpose() * poses[i]->rotation);
        const Eigen::Vector3d after =
            rotation_vector(poses[i]->rotation.transpose() * poses[i + 1]->rotation);
        note_worst(turns, degrees_from_radians((after - before).norm()), where);
      }
    }
    orthonormal.summary =
        fmt::format("Largest entry of R R' - I over {} poses; 2 for a reflection.", num_poses);
    orthonormal.reason = "Nine digits leave 1e-8.";
    orthonormal.detects = "a quaternion or matrix row off by 1e-5";
    jumps.summary =
        "Largest change from one step between frames to the next, in typical (median) steps.";
    jumps.reason =
        "Smooth flight changes its step by the turn of a frame in rad, under 1 for turns below 60 "
        "deg a frame; a row "
        "that stands twice makes 2.";
    jumps.detects = "a pose row repeated, dropped or swapped";
    turns.summary = "Largest change of the turn between frames.";
    turns.reason = "An aircraft does not change its turn by 30 deg from frame to frame.";
    turns.detects = "a flipped axis or quaternion order in single rows";
    std::vector<CheckResult> results{orthonormal, jumps, turns};
    for (CheckResult& result : results) {
      result.ok = num_poses > 0 && result.value <= result.bound;
      if (num_poses == 0) result.worst = "no poses";
    }
    return results;
  }
};

}  // namespace

std::unique_ptr<Checker> make_trajectory_check(const ValidateOptions&) {
  return std::make_unique<TrajectoryChecker>();
}

}  // namespace terracast::validate
