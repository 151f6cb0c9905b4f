#include "validate/checks/motion_agreement.h"

#include <fmt/format.h>

#include <algorithm>

#include "validate/checks/checker.h"
#include "validate/sampling.h"

namespace terracast::validate {

/// The mean of the velocities is that of the trapezoid with its ends' accelerations: exact for
/// motions of the fourth degree.
const MotionQuantity kVelocity = {
    [](const StatedMotion& from, const StatedMotion& to, double step_s) -> Eigen::Vector3d {
      return (to.local_from_body.translation - from.local_from_body.translation) / step_s -
             0.5 * (from.velocity_mps + to.velocity_mps) +
             (step_s / 12.0) * (to.acceleration_mps2 - from.acceleration_mps2);
    },
    [](const StatedMotion& from, const StatedMotion& to, double step_s) -> Eigen::Vector3d {
      return (step_s / 12.0) * (to.acceleration_mps2 - from.acceleration_mps2);
    }};
const MotionQuantity kAcceleration = {
    [](const StatedMotion& from, const StatedMotion& to, double step_s) -> Eigen::Vector3d {
      return (to.velocity_mps - from.velocity_mps) / step_s -
             0.5 * (from.acceleration_mps2 + to.acceleration_mps2);
    },
    [](const StatedMotion& from, const StatedMotion& to, double) -> Eigen::Vector3d {
      return 0.5 * (to.acceleration_mps2 - from.acceleration_mps2);
    }};
const MotionQuantity kTurnRate = {
    [](const StatedMotion& from, const StatedMotion& to, double step_s) -> Eigen::Vector3d {
      const Eigen::Matrix3d turn =
          from.local_from_body.rotation.transpose() * to.local_from_body.rotation;
      return rotation_vector(turn) / step_s - 0.5 * (from.turn_body_radps + to.turn_body_radps);
    },
    [](const StatedMotion& from, const StatedMotion& to, double) -> Eigen::Vector3d {
      return 0.5 * (to.turn_body_radps - from.turn_body_radps);
    }};

namespace {

/// Medians of sizes over all steps.
struct Agreement {
  double value = 0.0;      ///< of the residuals
  double curvature = 0.0;  ///< of what residuals of one step and of two differ by
  double variation = 0.0;
  std::size_t num_steps = 0;
  std::size_t worst_frame = 0;
};

Agreement agreement_of(const std::vector<std::optional<StatedMotion>>& motions, double step_s,
                       const MotionQuantity& quantity) {
  Agreement agreement;
  std::vector<double> sizes, curvatures, variations;
  double largest = -1.0;
  for (std::size_t i = 0; i + 1 < motions.size(); ++i) {
    if (!motions[i] || !motions[i + 1]) continue;
    const Eigen::Vector3d one = quantity.residual(*motions[i], *motions[i + 1], step_s);
    sizes.push_back(one.norm());
    variations.push_back(quantity.variation(*motions[i], *motions[i + 1], step_s).norm());
    if (one.norm() > largest) {
      largest = one.norm();
      agreement.worst_frame = i;
    }
    if (i + 2 >= motions.size() || !motions[i + 2]) continue;
    const Eigen::Vector3d next = quantity.residual(*motions[i + 1], *motions[i + 2], step_s);
    const Eigen::Vector3d two = quantity.residual(*motions[i], *motions[i + 2], 2.0 * step_s);
    curvatures.push_back((two - 0.5 * (one + next)).norm());
  }
  agreement.num_steps = sizes.size();
  agreement.value = median(sizes);
  agreement.curvature = median(curvatures);
  agreement.variation = median(variations);
  return agreement;
}

/// Frames in a row of which medians say what is typical: of five steps, and of four pairs of them.
constexpr std::size_t kEnoughFrames = 6;

/// Frames in a row at which something is said.
std::size_t longest_run(const std::vector<std::optional<StatedMotion>>& motions) {
  std::size_t longest = 0, run = 0;
  for (const auto& motion : motions) {
    run = motion ? run + 1 : 0;
    longest = std::max(longest, run);
  }
  return longest;
}

/// Whether frames follow each other fast enough to tell what moves between them, by the places alone and by no more
/// than what the turn rates add: a body that turns by more than half a turn from frame to frame, and goes farther than
/// its places are apart, may stand anywhere in between.
bool is_resolved(const std::vector<std::optional<StatedMotion>>& motions, double step_s) {
  constexpr double kHalfTurn = 3.14;
  constexpr double kLonger = 1.2;
  // Of motion of one frequency fourth differences are the second ones times (2 sin(w dt / 2))^2: 1 at six frames a
  // period, 4 at two.
  constexpr double kMost = 1.0;
  std::vector<double> second, fourth, turns, longer;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const auto place = [&](std::size_t at) { return motions[at]->local_from_body.translation; };
    const auto are_there = [&](std::size_t from, std::size_t to) {
      for (std::size_t at = from; at <= to; ++at)
        if (!motions[at]) return false;
      return true;
    };
    if (i + 1 < motions.size() && are_there(i, i + 1)) {
      turns.push_back(motions[i]->turn_body_radps.norm() * step_s);
      const double way_m =
          0.5 * step_s * (motions[i]->velocity_mps.norm() + motions[i + 1]->velocity_mps.norm());
      longer.push_back(way_m / std::max((place(i + 1) - place(i)).norm(), 1e-9));
    }
    if (i < 2 || i + 2 >= motions.size() || !are_there(i - 2, i + 2)) continue;
    const Eigen::Vector3d of_here = place(i - 1) - 2.0 * place(i) + place(i + 1);
    second.push_back(of_here.norm());
    fourth.push_back(((place(i - 2) - 2.0 * place(i - 1) + place(i)) - 2.0 * of_here +
                      (place(i) - 2.0 * place(i + 1) + place(i + 2)))
                         .norm());
  }
  if (median(turns) > kHalfTurn && median(longer) > kLonger) return false;
  // Below a tenth of a millimetre places are rounding.
  constexpr double kRounding_m = 1e-4;
  return fourth.empty() || median(fourth) <= kMost * median(second) + kRounding_m;
}

}  // namespace

CheckResult motion_result(const std::vector<std::optional<StatedMotion>>& motions, double step_s,
                          const MotionQuantity& quantity, double unit,
                          const MotionDescription& description) {
  const Agreement agreement = agreement_of(motions, step_s, quantity);
  if (agreement.num_steps < 2)
    return unseen_result(description.name, "fewer than three frames in a row");
  CheckResult result;
  result.name = description.name;
  result.value = agreement.value / unit;
  result.bound = description.bound;
  result.unit = description.unit;
  const double curvature = agreement.curvature / unit;
  // What the motion does between frames grows with the step, fourfold and more, until a step holds a
  // whole turn of it; a mistake does not. Residuals of a right dataset are a third of what they grow
  // by, or of the changes in a step; a few frames do not tell whether they follow the motion, and medians of two or
  // three are off by a factor of some.
  const double share = longest_run(motions) < kEnoughFrames ? 2.0 : 0.5;
  result.skipped = result.is_unseen =
      !result.is_within_bound() &&
      ((curvature > result.bound &&
        result.value <= share * std::max(curvature, agreement.variation / unit)) ||
       !is_resolved(motions, step_s));
  result.ok = result.skipped || result.is_within_bound();
  result.worst =
      result.skipped
          ? fmt::format("frames are too far apart: what the motion does between them is {:.2g} {}",
                        curvature, result.unit)
          : fmt::format("largest between frames {} and {}", agreement.worst_frame,
                        agreement.worst_frame + 1);
  result.summary =
      fmt::format("{} Median of {} steps; what two steps differ by from one is {:.2g}.",
                  description.summary, agreement.num_steps, curvature);
  result.reason = description.reason;
  result.detects = description.detects;
  return result;
}

double typical_speed_mps(const std::vector<std::optional<StatedMotion>>& motions) {
  std::vector<double> speeds_mps;
  for (const auto& motion : motions)
    if (motion) speeds_mps.push_back(motion->velocity_mps.norm());
  return std::max(median(speeds_mps), 1.0);
}

}  // namespace terracast::validate
