#include "validate/body_between.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "validate/body_pose.h"
#include "validate/oracle_view.h"

namespace terracast::validate {

namespace {

using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Place and turn against a pose nearby.
Vector6 against(const Pose& near, const Pose& other) {
  Vector6 six;
  six << other.translation - near.translation,
      rotation_vector(near.rotation.transpose() * other.rotation);
  return six;
}

Pose posed(const Pose& near, const Vector6& six) {
  const Vector3d turn = six.tail<3>();
  const double angle = turn.norm();
  Pose pose = near;
  pose.translation += six.head<3>();
  if (angle > 0.0) pose.rotation *= Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  return pose;
}

}  // namespace

BodyBetween::BodyBetween(const Dataset& dataset, const Sequence& sequence)
    : rate_hz_(sequence.rate_hz), format_(dataset.format) {
  for (std::size_t frame = 0; frame < static_cast<std::size_t>(sequence.num_frames); ++frame)
    poses_.push_back(local_from_body(sequence, frame));
}

std::optional<BodyBetween::Placed> BodyBetween::at(double time_s) const {
  const double frame = time_s * rate_hz_;
  const auto nearest = static_cast<std::ptrdiff_t>(std::llround(frame));
  const double off = frame - static_cast<double>(nearest);
  const std::optional<Pose> known = pose(nearest);
  if (!known) return std::nullopt;
  const PoseRounding rounding = pose_rounding(format_, distance_m(*known));
  constexpr double kAtFrame = 1e-9;
  if (std::abs(off) <= kAtFrame) return Placed{*known, rounding.position_m, rounding.angle_rad};
  const auto floor = static_cast<std::ptrdiff_t>(std::floor(frame));
  const std::optional<Vector6> cubic = between(*known, frame, floor - 1, 4);
  if (!cubic) return std::nullopt;
  // Through three of the four, and through four that are moved by one: with a jump of the acceleration, or of what follows
  // it, anywhere about, the largest difference is a quarter of the cubic's error or more; with every second frame besides
  // half of it (LidarFlight.…; 120 000 jumps drawn at random: 3.3 and 1.6 times).
  double doubt_m = 0.0, doubt_rad = 0.0;
  const auto differ = [&](std::ptrdiff_t first, int count, int step) {
    const std::optional<Vector6> other = between(*known, frame, first, count, step);
    if (!other) return false;
    doubt_m = std::max(doubt_m, (*other - *cubic).head<3>().norm());
    doubt_rad = std::max(doubt_rad, (*other - *cubic).tail<3>().norm());
    return true;
  };
  if (!differ(floor - 1, 3, 1) || !differ(floor, 3, 1) || !differ(floor - 2, 4, 1) ||
      !differ(floor, 4, 1))
    return std::nullopt;
  const bool has_half = differ(floor - 2, 4, 2) && differ(floor - 3, 4, 2);
  const double factor = has_half ? 2.0 : 4.0;
  // Lagrange's polynomials of poses that are rounded: their weights' sums of magnitudes are below 2 between the middle two.
  return Placed{posed(*known, *cubic), 2.0 * rounding.position_m + factor * doubt_m,
                2.0 * rounding.angle_rad + factor * doubt_rad};
}

std::optional<Pose> BodyBetween::at_frame_before(double time_s) const {
  return pose(static_cast<std::ptrdiff_t>(std::floor(time_s * rate_hz_ + 1e-9)));
}

std::optional<Pose> BodyBetween::pose(std::ptrdiff_t frame) const {
  if (frame < 0 || frame >= static_cast<std::ptrdiff_t>(poses_.size())) return std::nullopt;
  return poses_[static_cast<std::size_t>(frame)];
}

double BodyBetween::distance_m(const Pose& at) const {
  return poses_[0] ? (at.translation - poses_[0]->translation).norm() : 0.0;
}

std::optional<Vector6> BodyBetween::between(const Pose& near, double frame, std::ptrdiff_t first,
                                            int count, int step) const {
  Vector6 sum = Vector6::Zero();
  for (int i = 0; i < count; ++i) {
    const std::optional<Pose> one = pose(first + i * step);
    if (!one) return std::nullopt;
    double weight = 1.0;
    for (int k = 0; k < count; ++k)
      if (k != i) weight *= (frame - static_cast<double>(first + k * step)) / ((i - k) * step);
    sum += weight * against(near, *one);
  }
  return sum;
}

}  // namespace terracast::validate
