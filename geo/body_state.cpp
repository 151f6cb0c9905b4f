#include "geo/body_state.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>
#include <vector>

#include "core/error.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;

/// Derivative of the sum of term(k) t^(k + first), k from 0 to count - 1.
template <class Term>
auto slope_of(std::size_t count, const Term& term, int first, double t) {
  using Value = std::decay_t<decltype(term(std::size_t{0}))>;
  const auto factor = [&](std::size_t k) { return static_cast<double>(k) + first; };
  Value slope = factor(count - 1) * term(count - 1);
  for (std::size_t k = count - 1; k-- > 0;) slope = t * slope + factor(k) * term(k);
  for (int i = 0; i + 1 < first; ++i) slope *= t;
  return slope;
}

/// That sum, which beyond the reach goes on along its tangent.
template <class Term>
auto sum_of(std::size_t count, const Term& term, int first, double offset_s, double reach_s) {
  using Value = std::decay_t<decltype(term(std::size_t{0}))>;
  const double t = std::clamp(offset_s, -reach_s, reach_s);
  Value sum = term(count - 1);
  for (std::size_t k = count - 1; k-- > 0;) sum = t * sum + term(k);
  for (int i = 0; i < first; ++i) sum *= t;
  if (t != offset_s) sum += (offset_s - t) * slope_of(count, term, first, t);
  return sum;
}

template <std::size_t kCount>
Vector3d sum_of(const std::array<Vector3d, kCount>& terms, int first, double offset_s,
                double reach_s) {
  return sum_of(
      kCount, [&](std::size_t k) -> const Vector3d& { return terms[k]; }, first, offset_s, reach_s);
}

template <std::size_t kCount>
double most_of(const std::array<Vector3d, kCount>& terms, int first, double offset_s,
               double reach_s) {
  return sum_of(
      kCount, [&](std::size_t k) { return terms[k].norm(); }, first, std::abs(offset_s), reach_s);
}

constexpr int kFirstOfPosition = 3;
constexpr int kFirstOfTurning = 2;

/// Least squares: the first `count` powers from `first` on of t / reach, for `values` at `times`.
Eigen::MatrixXd fitted(const std::vector<double>& times, const Eigen::MatrixXd& values, int first,
                       int count) {
  Eigen::MatrixXd powers(values.rows(), count);
  for (Eigen::Index i = 0; i < powers.rows(); ++i)
    for (Eigen::Index k = 0; k < count; ++k)
      powers(i, k) = std::pow(times[static_cast<std::size_t>(i)], static_cast<int>(k) + first);
  return powers.colPivHouseholderQr().solve(values);
}

/// The motion beyond a state's first derivatives, sampled at several times.
struct Samples {
  std::vector<double> offsets_s;
  std::vector<double> shares;  ///< of the reach
  Eigen::MatrixXd positions;   ///< one row a time
  Eigen::MatrixXd turnings;
};

Samples sample(const BodyState& state, const std::function<Rigid3d(double)>& pose_at,
               const std::vector<double>& shares, double reach_s, const Vector3d& spin) {
  Samples samples{.offsets_s = {},
                  .shares = shares,
                  .positions = Eigen::MatrixXd(static_cast<Eigen::Index>(shares.size()), 3),
                  .turnings = Eigen::MatrixXd(static_cast<Eigen::Index>(shares.size()), 3)};
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double t = shares[i] * reach_s;
    const Rigid3d pose = pose_at(t);
    samples.offsets_s.push_back(t);
    samples.positions.row(static_cast<Eigen::Index>(i)) =
        pose.translation - state.world_from_body.translation -
        t * (state.velocity_world_mps + 0.5 * t * state.acceleration_world_mps2);
    const Vector3d uniform = t * (state.angular_velocity_body_radps - spin);
    Vector3d vector = rotation_vector_of(state.world_from_body.rotation.conjugate() *
                                         pose.rotation * rotation_of(-t * spin));
    // Of the vectors that mean the same rotation, the one that lies near.
    const double angle = vector.norm();
    if (angle > 0.0) {
      const Vector3d axis = vector / angle;
      const double turn = 2.0 * std::numbers::pi;
      vector += turn * std::round((uniform.dot(axis) - angle) / turn) * axis;
    }
    samples.turnings.row(static_cast<Eigen::Index>(i)) = vector - uniform;
  }
  return samples;
}

double error_m(const MotionTerms& terms, const Samples& samples) {
  double most = 0.0;
  for (std::size_t i = 0; i < samples.offsets_s.size(); ++i)
    most = std::max(most, (terms.position_after(samples.offsets_s[i]) -
                           samples.positions.row(static_cast<Eigen::Index>(i)).transpose())
                              .norm());
  return most;
}

/// A vector that is off by e turns by an angle that is off by |e| at most.
double error_rad(const MotionTerms& terms, const Samples& samples) {
  double most = 0.0;
  for (std::size_t i = 0; i < samples.offsets_s.size(); ++i)
    most = std::max(most, (terms.turning_after(samples.offsets_s[i]) -
                           samples.turnings.row(static_cast<Eigen::Index>(i)).transpose())
                              .norm());
  return most;
}

template <std::size_t kCount>
void set_terms(std::array<Vector3d, kCount>& terms, const Samples& samples,
               const Eigen::MatrixXd& values, int first, int count, double reach_s) {
  terms.fill(Vector3d::Zero());
  if (count == 0) return;
  const Eigen::MatrixXd fit = fitted(samples.shares, values, first, count);
  for (int k = 0; k < count; ++k)
    terms[static_cast<std::size_t>(k)] = fit.row(k).transpose() / std::pow(reach_s, k + first);
}

}  // namespace

Eigen::Quaterniond rotation_of(const Vector3d& vector_rad) {
  const Vector3d half_turn = 0.5 * vector_rad;
  const double half_angle = half_turn.norm();
  // sin x / x, which is 1 - x^2 / 6 to double where x^4 / 120 is lost.
  const double share =
      half_angle > 1e-4 ? std::sin(half_angle) / half_angle : 1.0 - half_angle * half_angle / 6.0;
  return {std::cos(half_angle), share * half_turn.x(), share * half_turn.y(),
          share * half_turn.z()};
}

Vector3d rotation_vector_of(Eigen::Quaterniond rotation) {
  if (rotation.w() < 0.0) rotation.coeffs() *= -1.0;
  const double half_sine = rotation.vec().norm();
  if (half_sine < 1e-12) return 2.0 * rotation.vec();
  return 2.0 * std::atan2(half_sine, rotation.w()) / half_sine * rotation.vec();
}

Vector3d MotionTerms::position_after(double offset_s) const {
  return sum_of(position_world, kFirstOfPosition, offset_s, reach_s);
}

Vector3d MotionTerms::velocity_after(double offset_s) const {
  return slope_of(
      position_world.size(), [&](std::size_t k) -> const Vector3d& { return position_world[k]; },
      kFirstOfPosition, std::clamp(offset_s, -reach_s, reach_s));
}

Vector3d MotionTerms::turning_after(double offset_s) const {
  return sum_of(turning_body, kFirstOfTurning, offset_s, reach_s);
}

double MotionTerms::most_position_m(double offset_s) const {
  return most_of(position_world, kFirstOfPosition, offset_s, reach_s);
}

double MotionTerms::most_turning_rad(double offset_s) const {
  return most_of(turning_body, kFirstOfTurning, offset_s, reach_s);
}

Rigid3d BodyState::pose_after(double offset_s) const {
  if (offset_s == 0.0) return world_from_body;
  const Vector3d uniform_m =
      offset_s * (velocity_world_mps + 0.5 * offset_s * acceleration_world_mps2);
  if (!terms.are_any())
    return {
        .rotation = (world_from_body.rotation * rotation_of(offset_s * angular_velocity_body_radps))
                        .normalized(),
        .translation = world_from_body.translation + uniform_m};
  Eigen::Quaterniond turn =
      rotation_of(offset_s * (angular_velocity_body_radps - terms.spin_body_radps) +
                  terms.turning_after(offset_s));
  if (!terms.spin_body_radps.isZero(0.0))
    turn = turn * rotation_of(offset_s * terms.spin_body_radps);
  return {
      .rotation = (world_from_body.rotation * turn).normalized(),
      .translation = world_from_body.translation + (uniform_m + terms.position_after(offset_s))};
}

Vector3d BodyState::velocity_after(double offset_s) const {
  return velocity_world_mps + offset_s * acceleration_world_mps2 + terms.velocity_after(offset_s);
}

MotionTerms fit_terms(const BodyState& state, const std::function<Rigid3d(double)>& pose_at,
                      double reach_s, const Vector3d& spin_body_radps) {
  TERRACAST_CHECK(reach_s > 0.0, "a reach of {} s", reach_s);
  constexpr int kPoints = 12;
  std::vector<double> points, between;
  for (int i = 0; i < kPoints; ++i)
    points.push_back(std::cos(std::numbers::pi * (i + 0.5) / kPoints));
  for (int i = 0; i <= kPoints; ++i) between.push_back(std::cos(std::numbers::pi * i / kPoints));
  const Samples samples = sample(state, pose_at, points, reach_s, spin_body_radps);
  const Samples others = sample(state, pose_at, between, reach_s, spin_body_radps);
  MotionTerms terms;
  terms.reach_s = reach_s;
  terms.spin_body_radps = spin_body_radps;
  constexpr double kEnough_m = 1e-9, kEnough_rad = 1e-10;
  // Between the points they are larger by an eighth about a knot, and by less elsewhere.
  constexpr double kUnseen = 2.0;
  for (int count = 0; count <= static_cast<int>(terms.position_world.size()); ++count) {
    set_terms(terms.position_world, samples, samples.positions, kFirstOfPosition, count, reach_s);
    terms.error_m = kUnseen * std::max(error_m(terms, samples), error_m(terms, others));
    if (terms.error_m <= kEnough_m) break;
  }
  for (int count = 0; count <= static_cast<int>(terms.turning_body.size()); ++count) {
    set_terms(terms.turning_body, samples, samples.turnings, kFirstOfTurning, count, reach_s);
    terms.error_rad = kUnseen * std::max(error_rad(terms, samples), error_rad(terms, others));
    if (terms.error_rad <= kEnough_rad) break;
  }
  return terms;
}

}  // namespace terracast::geo
