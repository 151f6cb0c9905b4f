#include "validate/evaluate/truth_between.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

using FourFrames = std::array<std::size_t, 4>;

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(rotation).normalized());
  return turn.angle() * turn.axis();
}

/// The cubic through four frames, all of which are there.
Pose cubic_pose(PosePath frames, std::span<const double> times_s, const FourFrames& four,
                double time_s) {
  const Eigen::Matrix3d& reference = frames[four[1]]->rotation;
  Pose pose;
  pose.translation.setZero();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  for (const std::size_t k : four) {
    double weight = 1.0;
    for (const std::size_t other : four)
      if (other != k) weight *= (time_s - times_s[other]) / (times_s[k] - times_s[other]);
    pose.translation += weight * frames[k]->translation;
    turn += weight * rotation_vector(reference.transpose() * frames[k]->rotation);
  }
  const double angle = turn.norm();
  pose.rotation = reference;
  if (angle > 0.0) pose.rotation *= Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  return pose;
}

struct LeftOut {
  double off_m = 0.0;
  double off_deg = 0.0;
};

/// By how much each frame's prediction without itself is off.
std::vector<std::optional<LeftOut>> left_out_errors(PosePath frames,
                                                    std::span<const double> times_s) {
  std::vector<std::optional<LeftOut>> errors(frames.size());
  for (std::size_t i = 3; i + 3 < frames.size(); ++i) {
    const FourFrames four{i - 3, i - 1, i + 1, i + 3};
    if (!frames[i] || std::any_of(four.begin(), four.end(),
                                  [&](std::size_t k) { return !frames[k].has_value(); }))
      continue;
    const Pose pose = cubic_pose(frames, times_s, four, times_s[i]);
    errors[i] =
        LeftOut{(pose.translation - frames[i]->translation).norm(),
                degrees_from_radians(
                    rotation_vector(pose.rotation.transpose() * frames[i]->rotation).norm())};
  }
  return errors;
}

}  // namespace

TruthAtTimes truth_at_times(PosePath frames, std::span<const double> frame_times_s,
                            std::span<const double> times_s, double most_left_out_m,
                            double most_left_out_deg) {
  TERRACAST_CHECK(frames.size() == frame_times_s.size());
  for (std::size_t i = 1; i < frame_times_s.size(); ++i)
    if (!(frame_times_s[i] > frame_times_s[i - 1]))
      fail(ErrorKind::Input, "frames {} and {} are both at {} s: no truth lies between them", i - 1,
           i, frame_times_s[i]);
  const std::vector<std::optional<LeftOut>> left_out = left_out_errors(frames, frame_times_s);
  const auto is_exact = [&](std::size_t frame) {
    return left_out[frame] && left_out[frame]->off_m <= most_left_out_m &&
           left_out[frame]->off_deg <= most_left_out_deg;
  };
  TruthAtTimes truth;
  truth.poses.resize(times_s.size());
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const double time_s = times_s[i];
    const auto next = static_cast<std::size_t>(
        std::lower_bound(frame_times_s.begin(), frame_times_s.end(), time_s) -
        frame_times_s.begin());
    bool is_frame = false;
    for (const std::size_t frame : {next, next - 1})
      if (frame < frames.size() && std::abs(frame_times_s[frame] - time_s) <= kSameTime_s) {
        is_frame = true;
        truth.poses[i] = frames[frame];
        break;
      }
    if (is_frame) {
      if (!truth.poses[i]) ++truth.num_inexact;
      continue;
    }
    if (next == 0 || next == frames.size()) {
      ++truth.num_outside;
      continue;
    }
    if (!is_exact(next - 1) || !is_exact(next)) {
      ++truth.num_inexact;
      continue;
    }
    for (const std::size_t frame : {next - 1, next}) {
      truth.worst_left_out_m = std::max(truth.worst_left_out_m, left_out[frame]->off_m);
      truth.worst_left_out_deg = std::max(truth.worst_left_out_deg, left_out[frame]->off_deg);
    }
    truth.poses[i] =
        cubic_pose(frames, frame_times_s, {next - 2, next - 1, next, next + 1}, time_s);
  }
  return truth;
}

}  // namespace terracast::validate
