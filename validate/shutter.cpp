#include "validate/shutter.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terracast::validate {

namespace {

/// In the order of Readout.
constexpr std::array<const char*, 4> kNames = {"down", "up", "right", "left"};

bool is_of_columns(Readout readout) {
  return readout == Readout::Right || readout == Readout::Left;
}
double sign_of(Readout readout) {
  return readout == Readout::Down || readout == Readout::Right ? 1.0 : -1.0;
}

}  // namespace

const char* name_of(Readout readout) { return kNames[static_cast<std::size_t>(readout)]; }

std::optional<Readout> readout_of(std::string_view name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<Readout>(found - kNames.begin());
}

Readout opposite(Readout readout) {
  switch (readout) {
    case Readout::Down:
      return Readout::Up;
    case Readout::Up:
      return Readout::Down;
    case Readout::Right:
      return Readout::Left;
    case Readout::Left:
      break;
  }
  return Readout::Right;
}

double Shutter::offset_s(const Eigen::Vector2d& pixel, const Intrinsics& camera) const {
  return slope_s().dot(pixel - 0.5 * Eigen::Vector2d(camera.width_px, camera.height_px));
}

Eigen::Vector2d Shutter::slope_s() const {
  const double slope = sign_of(readout) * line_time_s;
  return is_of_columns(readout) ? Eigen::Vector2d(slope, 0.0) : Eigen::Vector2d(0.0, slope);
}

double Shutter::reach_s(const Intrinsics& camera) const {
  return 0.5 * line_time_s * (is_of_columns(readout) ? camera.width_px : camera.height_px);
}

// Rodrigues: with the cross product matrix K of w and the angle p = |w| t,
// exp(t K) = 1 + sin p / p t K + (1 - cos p) / p^2 (t K)^2, and 1 - cos p = 2 sin^2 (p / 2).
Pose BodyMotion::start_from_body(double offset_s) const {
  const Eigen::Vector3d turn = offset_s * turn_radps;
  const double angle = turn.norm();
  Eigen::Matrix3d cross;
  cross << 0.0, -turn.z(), turn.y(), turn.z(), 0.0, -turn.x(), -turn.y(), turn.x(), 0.0;
  // sin x / x; below 1e-4 the next term of its series, x^4 / 120, is lost in a double.
  const auto sinc = [](double x) { return x < 1e-4 ? 1.0 - x * x / 6.0 : std::sin(x) / x; };
  const double half = sinc(0.5 * angle);
  return {Eigen::Matrix3d::Identity() + sinc(angle) * cross + 0.5 * half * half * cross * cross,
          offset_s * velocity_mps + 0.5 * offset_s * offset_s * acceleration_mps2};
}

Eigen::Vector3d LineMotion::velocity_mps(double offset_s) const {
  const Eigen::Matrix3d start_from_body = body.start_from_body(offset_s).rotation;
  const Eigen::Vector3d velocity_body =
      start_from_body.transpose() * (body.velocity_mps + offset_s * body.acceleration_mps2) +
      body.turn_radps.cross(body_from_camera.translation);
  return body_from_camera.rotation.transpose() * velocity_body;
}

}  // namespace terracast::validate
