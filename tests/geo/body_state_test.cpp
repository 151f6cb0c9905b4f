// What a state holds of the motion about its time.

#include "geo/body_state.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace terracast::geo {
namespace {

using Eigen::Vector3d;

/// A motion in closed form: three swings of the place, and two turns of the attitude, one on the other.
struct Swinging {
  double turn_rad = 0.0;      ///< amplitude of each turn
  double turn_rate_hz = 0.0;  ///< how often a second
  double way_m = 0.0;
  Vector3d speed_mps = {15.0, -4.0, 2.0};

  double rate() const { return 2.0 * M_PI * turn_rate_hz; }
  Rigid3d pose(double t) const {
    const Eigen::AngleAxisd roll(turn_rad * std::sin(rate() * t), Vector3d::UnitX());
    const Eigen::AngleAxisd pitch(turn_rad * std::cos(0.8 * rate() * t), Vector3d::UnitY());
    const Vector3d swing(std::sin(rate() * t), std::cos(0.9 * rate() * t),
                         std::sin(1.1 * rate() * t + 1.0));
    return {Eigen::Quaterniond(roll * pitch), t * speed_mps + way_m * swing};
  }
  /// By derivatives in closed form.
  BodyState state(double t) const {
    const double w = rate();
    BodyState state;
    state.world_from_body = pose(t);
    state.velocity_world_mps =
        speed_mps + way_m * Vector3d(w * std::cos(w * t), -0.9 * w * std::sin(0.9 * w * t),
                                     1.1 * w * std::cos(1.1 * w * t + 1.0));
    state.acceleration_world_mps2 =
        way_m * Vector3d(-w * w * std::sin(w * t), -0.81 * w * w * std::cos(0.9 * w * t),
                         -1.21 * w * w * std::sin(1.1 * w * t + 1.0));
    const double roll_rate = turn_rad * w * std::cos(w * t);
    const double pitch_rate = -turn_rad * 0.8 * w * std::sin(0.8 * w * t);
    const Eigen::AngleAxisd pitch(turn_rad * std::cos(0.8 * w * t), Vector3d::UnitY());
    state.angular_velocity_body_radps =
        pitch.inverse() * Vector3d(roll_rate * Vector3d::UnitX()) + pitch_rate * Vector3d::UnitY();
    return state;
  }
};

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return rotation_vector_of(a.conjugate() * b).norm();
}

struct Errors {
  double m = 0.0, rad = 0.0;
};

Errors errors_of(const BodyState& state, const std::function<Rigid3d(double)>& pose_at,
                 double reach_s) {
  Errors errors;
  constexpr int kTimes = 401;
  for (int i = 0; i < kTimes; ++i) {
    const double t = reach_s * (2.0 * i / (kTimes - 1) - 1.0);
    const Rigid3d stated = state.pose_after(t), true_pose = pose_at(t);
    errors.m = std::max(errors.m, (stated.translation - true_pose.translation).norm());
    errors.rad = std::max(errors.rad, angle_between(stated.rotation, true_pose.rotation));
  }
  return errors;
}

// Angular accelerations of 10 rad/s^2 at 2 Hz, those of a brisk quadrotor. A line 15 ms from the middle was 1.1 mrad
// off by constant angular velocities, which is 0.4 px at a focal length of 320 px.
TEST(BodyStates, LinesOfABriskMotionAreWhereTheMotionIs) {
  Swinging motion{.turn_rad = 10.0 / (4.0 * M_PI * 4.0 * M_PI), .turn_rate_hz = 2.0, .way_m = 0.3};
  constexpr double kReach_s = 0.015, kFocal_px = 320.0;
  double most_before_px = 0.0, most_px = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double time_s = 0.0173 * i;
    const auto pose_at = [&](double t) { return motion.pose(time_s + t); };
    BodyState state = motion.state(time_s);
    most_before_px = std::max(most_before_px, kFocal_px * errors_of(state, pose_at, kReach_s).rad);
    state.terms = fit_terms(state, pose_at, kReach_s);
    const Errors errors = errors_of(state, pose_at, kReach_s);
    ASSERT_LE(errors.m, state.terms.error_m);
    ASSERT_LE(errors.rad, state.terms.error_rad);
    ASSERT_LT(errors.m, 1e-8);
    ASSERT_LT(errors.rad, 2e-9);
    most_px = std::max(most_px, kFocal_px * errors.rad);
  }
  RecordProperty("constants_px", fmt::format("{:.3g}", most_before_px));
  RecordProperty("terms_px", fmt::format("{:.3g}", most_px));
  EXPECT_GT(most_before_px, 0.3);
  EXPECT_LT(most_px, 1e-6);
}

TEST(BodyStates, ErrorsFallWithTheSixthPowerOfTheReach) {
  Swinging motion{.turn_rad = 0.3, .turn_rate_hz = 1.0, .way_m = 2.0};
  BodyState state = motion.state(0.4);
  const auto pose_at = [&](double t) { return motion.pose(0.4 + t); };
  const auto errors = [&](double reach_s) {
    state.terms = fit_terms(state, pose_at, reach_s);
    return errors_of(state, pose_at, reach_s);
  };
  const Errors wide = errors(0.12), narrow = errors(0.06);
  EXPECT_NEAR(std::log2(wide.m / narrow.m), 6.0, 0.5);
  EXPECT_NEAR(std::log2(wide.rad / narrow.rad), 6.0, 0.5);
}

// The jump of a derivative anywhere within the reach.
TEST(BodyStates, ErrorsAboutKnotsAreWhatIsStated) {
  constexpr double kReach_s = 0.015, kJerk = 40.0, kAlpha = 3.0;
  double most_m = 0.0, most_rad = 0.0;
  for (double knot_s = -0.0149; knot_s < 0.0149; knot_s += 0.0004) {
    // The derivatives before the knot are nought, so that the state's own are those at 0.
    const auto pose_at = [&](double t) -> Rigid3d {
      const double on_s = std::max(t - knot_s, 0.0);
      return {rotation_of(0.5 * kAlpha * on_s * on_s * Vector3d::UnitX()),
              kJerk / 6.0 * on_s * on_s * on_s * Vector3d::UnitY()};
    };
    const double on_s = std::max(-knot_s, 0.0);
    BodyState state;
    state.world_from_body = pose_at(0.0);
    state.velocity_world_mps = kJerk / 2.0 * on_s * on_s * Vector3d::UnitY();
    state.acceleration_world_mps2 = kJerk * on_s * Vector3d::UnitY();
    state.angular_velocity_body_radps = kAlpha * on_s * Vector3d::UnitX();
    state.terms = fit_terms(state, pose_at, kReach_s);
    const Errors errors = errors_of(state, pose_at, kReach_s);
    ASSERT_LE(errors.m, state.terms.error_m);
    ASSERT_LE(errors.rad, state.terms.error_rad);
    most_m = std::max(most_m, errors.m);
    most_rad = std::max(most_rad, errors.rad);
  }
  RecordProperty("share_of_jerk", fmt::format("{:.3g}", most_m / (kJerk * std::pow(kReach_s, 3))));
  RecordProperty("share_of_alpha",
                 fmt::format("{:.3g}", most_rad / (kAlpha * std::pow(kReach_s, 2))));
  EXPECT_LT(most_m, 0.0075 * kJerk * std::pow(kReach_s, 3));
  EXPECT_LT(most_rad, 0.013 * kAlpha * std::pow(kReach_s, 2));
}

// A rotor of 6000 a minute turns by 9.4 rad in 15 ms, on a body that turns itself.
TEST(BodyStates, SpinsOfManyTurnsAreExact) {
  Swinging motion{.turn_rad = 0.1, .turn_rate_hz = 1.5, .way_m = 0.2};
  constexpr double kReach_s = 0.015, kSpin = 628.0;
  const auto pose_at = [&](double t) -> Rigid3d {
    const Rigid3d body = motion.pose(0.2 + t);
    return {body.rotation * rotation_of((0.7 + kSpin * t) * Vector3d::UnitZ()), body.translation};
  };
  BodyState state = motion.state(0.2);
  state.world_from_body = pose_at(0.0);
  state.angular_velocity_body_radps =
      rotation_of(-0.7 * Vector3d::UnitZ()) * state.angular_velocity_body_radps +
      kSpin * Vector3d::UnitZ();
  state.terms = fit_terms(state, pose_at, kReach_s, kSpin * Vector3d::UnitZ());
  const Errors errors = errors_of(state, pose_at, kReach_s);
  EXPECT_LE(errors.rad, state.terms.error_rad);
  EXPECT_LT(errors.rad, 2e-9);
}

TEST(BodyStates, WithoutTermsTheyGoOnWithConstants) {
  Swinging motion{.turn_rad = 0.3, .turn_rate_hz = 1.0, .way_m = 2.0};
  const BodyState state = motion.state(1.1);
  for (const double t : {-0.2, -0.01, 0.01, 0.3}) {
    const Rigid3d pose = state.pose_after(t);
    const Vector3d place = state.world_from_body.translation + t * state.velocity_world_mps +
                           0.5 * t * t * state.acceleration_world_mps2;
    const Eigen::Quaterniond rotation =
        state.world_from_body.rotation *
        Eigen::Quaterniond(Eigen::AngleAxisd(t * state.angular_velocity_body_radps.norm(),
                                             state.angular_velocity_body_radps.normalized()));
    EXPECT_LT((pose.translation - place).norm(), 1e-14);
    EXPECT_LT(angle_between(pose.rotation, rotation), 1e-15);
  }
  // A motion that does just that needs no terms.
  const MotionTerms terms = fit_terms(
      state, [&](double t) { return state.pose_after(t); }, 0.02);
  for (const Vector3d& term : terms.position_world) EXPECT_EQ(term, Vector3d::Zero());
  for (const Vector3d& term : terms.turning_body) EXPECT_EQ(term, Vector3d::Zero());
}

// Points that no line of the image sees are looked for farther out.
TEST(BodyStates, BeyondTheReachTheTermsGoOnAlongTheirTangents) {
  Swinging motion{.turn_rad = 0.3, .turn_rate_hz = 1.0, .way_m = 2.0};
  BodyState state = motion.state(0.4);
  constexpr double kReach_s = 0.05, kStep_s = 1e-6;
  state.terms = fit_terms(
      state, [&](double t) { return motion.pose(0.4 + t); }, kReach_s);
  for (const double end_s : {-kReach_s, kReach_s}) {
    const double outward_s = end_s < 0.0 ? -kStep_s : kStep_s;
    const Vector3d slope =
        (state.terms.position_after(end_s) - state.terms.position_after(end_s - outward_s)) /
        outward_s;
    const Vector3d far = state.terms.position_after(3.0 * end_s);
    EXPECT_LT((far - state.terms.position_after(end_s) - 2.0 * end_s * slope).norm(),
              1e-4 * far.norm());
    const Vector3d turning_slope =
        (state.terms.turning_after(end_s) - state.terms.turning_after(end_s - outward_s)) /
        outward_s;
    const Vector3d far_turn = state.terms.turning_after(3.0 * end_s);
    EXPECT_LT((far_turn - state.terms.turning_after(end_s) - 2.0 * end_s * turning_slope).norm(),
              1e-4 * far_turn.norm());
    EXPECT_GE(state.terms.most_position_m(3.0 * end_s), far.norm());
    EXPECT_GE(state.terms.most_turning_rad(3.0 * end_s), far_turn.norm());
  }
}

}  // namespace
}  // namespace terracast::geo
