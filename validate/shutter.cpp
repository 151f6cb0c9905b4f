#include "validate/shutter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

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

namespace {

/// sin x / x; below 1e-4 the next term of its series, x^4 / 120, is lost in a double.
double sinc(double x) { return x < 1e-4 ? 1.0 - x * x / 6.0 : std::sin(x) / x; }

Eigen::Matrix3d cross_of(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return cross;
}

/// Rodrigues: with the cross product matrix K of f and the angle p = |f|,
/// exp(K) = 1 + sin p / p K + (1 - cos p) / p^2 K^2, and 1 - cos p = 2 sin^2 (p / 2).
struct Turn {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  ///< f
  double once = 1.0;                               ///< sin p / p
  double twice = 0.5;                              ///< (1 - cos p) / p^2

  explicit Turn(const Eigen::Vector3d& turn) : axis(turn) {
    const double angle = turn.norm();
    const double half = sinc(0.5 * angle);
    once = sinc(angle);
    twice = 0.5 * half * half;
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& v) const {
    const Eigen::Vector3d across = axis.cross(v);
    return v + once * across + twice * axis.cross(across);
  }
  /// By the inverse.
  Eigen::Vector3d undone(const Eigen::Vector3d& v) const {
    const Eigen::Vector3d across = axis.cross(v);
    return v - once * across + twice * axis.cross(across);
  }
  Eigen::Matrix3d matrix() const {
    const Eigen::Matrix3d cross = cross_of(axis);
    return Eigen::Matrix3d::Identity() + once * cross + twice * cross * cross;
  }
};

/// A sum of powers of the time, its terms from `first` on, and its derivative.
struct Sum {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
};
template <class Terms>
Sum sum_at(const Terms& terms, int first, double offset_s, double reach_s) {
  const double inside_s = std::max(-reach_s, std::min(reach_s, offset_s));
  double power = inside_s;  // one less than the term's
  for (int k = 2; k < first; ++k) power *= inside_s;
  Sum sum;
  for (int k = 0; k < terms.cols(); ++k, power *= inside_s) {
    sum.value += power * inside_s * terms.col(k);
    sum.rate += (first + k) * power * terms.col(k);
  }
  sum.value += (offset_s - inside_s) * sum.rate;
  return sum;
}

}  // namespace

void set_terms(const double* values, const std::string& where, BodyMotion& motion) {
  for (int k = 0; k < 3; ++k) motion.p.col(k) = Eigen::Map<const Eigen::Vector3d>(values + 3 * k);
  for (int k = 0; k < 4; ++k)
    motion.r.col(k) = Eigen::Map<const Eigen::Vector3d>(values + 9 + 3 * k);
  motion.spin_radps = Eigen::Map<const Eigen::Vector3d>(values + 21);
  motion.reach_s = values[24];
  if (!(motion.reach_s >= 0.0))
    core::fail(core::ErrorKind::Input, "{}: reach_s = {} is below 0", where, motion.reach_s);
}

Eigen::Vector3d BodyMotion::place_m(double offset_s) const {
  return offset_s * velocity_mps + 0.5 * offset_s * offset_s * acceleration_mps2 +
         sum_at(p, 3, offset_s, reach_s).value;
}

Eigen::Vector3d BodyMotion::turn_rad(double offset_s) const {
  return offset_s * (turn_radps - spin_radps) + sum_at(r, 2, offset_s, reach_s).value;
}

Pose BodyMotion::start_from_body(double offset_s) const {
  return {Turn(turn_rad(offset_s)).matrix() * Turn(offset_s * spin_radps).matrix(),
          place_m(offset_s)};
}

Eigen::Vector3d BodyMotion::direction_at(double offset_s, const Eigen::Vector3d& direction) const {
  return Turn(offset_s * spin_radps).undone(Turn(turn_rad(offset_s)).undone(direction));
}

Eigen::Vector3d BodyMotion::velocity_mps_at(double offset_s) const {
  return velocity_mps + offset_s * acceleration_mps2 + sum_at(p, 3, offset_s, reach_s).rate;
}

// exp(f) turns at (1 - (1 - cos p) / p^2 F + (p - sin p) / p^3 F^2) f', F the cross product matrix of f and p = |f|;
// the last factor is 1 / 6 to double where p^2 / 120 is lost beside it.
Eigen::Vector3d BodyMotion::turn_radps_at(double offset_s) const {
  const Sum sum = sum_at(r, 2, offset_s, reach_s);
  const Eigen::Vector3d turn = offset_s * (turn_radps - spin_radps) + sum.value;
  const Eigen::Vector3d rate = turn_radps - spin_radps + sum.rate;
  const double angle = turn.norm();
  const Eigen::Matrix3d cross = cross_of(turn);
  const double half = sinc(0.5 * angle);
  const double third = angle < 1e-4 ? 1.0 / 6.0 : (1.0 - sinc(angle)) / (angle * angle);
  const Eigen::Vector3d turning =
      rate - 0.5 * half * half * (cross * rate) + third * (cross * (cross * rate));
  return Turn(offset_s * spin_radps).undone(turning) + spin_radps;
}

Eigen::Vector3d LineMotion::velocity_mps(double offset_s) const {
  const Eigen::Matrix3d start_from_body = body.start_from_body(offset_s).rotation;
  const Eigen::Vector3d velocity_body =
      start_from_body.transpose() * body.velocity_mps_at(offset_s) +
      body.turn_radps_at(offset_s).cross(body_from_camera.translation);
  return body_from_camera.rotation.transpose() * velocity_body;
}

}  // namespace terracast::validate
