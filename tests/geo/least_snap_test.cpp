// Curves of least snap against closed forms and the conditions of a minimum.

#include "geo/paths/least_snap.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "geo/paths/segment_times.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;

/// Points along a random walk of legs of 5 to 60 m, and durations of 1 to 9 s.
struct Walk {
  std::vector<Vector3d> points;
  std::vector<double> durations_s;
};

Walk random_walk(int num_legs, unsigned seed, bool is_closed = false) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> step(-35.0, 35.0), duration(1.0, 9.0);
  Walk walk{.points = {{10.0, -5.0, 8.0}}, .durations_s = {}};
  for (int i = 0; i < num_legs; ++i) {
    walk.points.push_back(walk.points.back() +
                          Vector3d(step(random), step(random), 0.3 * step(random)));
    walk.durations_s.push_back(duration(random));
  }
  if (is_closed) {
    walk.points.push_back(walk.points.front());
    walk.durations_s.push_back(duration(random));
  }
  return walk;
}

/// The n-th derivative by time of a coordinate of a piece at x.
double derivative_at(const LeastSnapCurve& curve, std::size_t piece, int axis, int order,
                     double x) {
  Polynomial polynomial = curve.coordinate_of(piece, axis);
  for (int i = 0; i < order; ++i) polynomial = derivative_of(polynomial);
  return value_of(polynomial, x) / std::pow(curve.piece_s(piece), order);
}

/// The sum of the sizes of that derivative's terms at the end, by which rounding is measured.
double size_of(const LeastSnapCurve& curve, std::size_t piece, int axis, int order) {
  Polynomial polynomial = curve.coordinate_of(piece, axis);
  for (int i = 0; i < order; ++i) polynomial = derivative_of(polynomial);
  double sum = 0.0;
  for (const double coefficient : polynomial) sum += std::abs(coefficient);
  return sum / std::pow(curve.piece_s(piece), order);
}

TEST(LeastSnap, FromRestToRestIsThePublishedPolynomialWithItsCost) {
  const Vector3d from(10.0, -20.0, 30.0), way(3.0, 4.0, 12.0);
  const double duration_s = 2.5;
  const LeastSnapCurve curve({from, from + way}, {duration_s}, false);
  for (int i = 0; i <= 20; ++i) {
    const double x = i / 20.0;
    const double share = std::pow(x, 4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)));
    EXPECT_LT((curve.at(x * duration_s).position - from - share * way).norm(), 1e-13);
  }
  EXPECT_NEAR(curve.cost() / (100800.0 * way.squaredNorm() / std::pow(duration_s, 7)), 1.0, 1e-12);
}

TEST(LeastSnap, SlowerByKCostsKToThePowerOfMinusSeven) {
  const Walk walk = random_walk(6, 3);
  const LeastSnapCurve curve(walk.points, walk.durations_s, false);
  for (const double factor : {0.3, 2.0, 11.0}) {
    std::vector<double> durations_s = walk.durations_s;
    for (double& duration_s : durations_s) duration_s *= factor;
    const LeastSnapCurve solved(walk.points, durations_s, false);
    const LeastSnapCurve slowed = curve.slowed(factor);
    EXPECT_NEAR(solved.cost() * std::pow(factor, 7) / curve.cost(), 1.0, 1e-11);
    EXPECT_NEAR(slowed.cost() / solved.cost(), 1.0, 1e-11);
    for (int i = 0; i <= 50; ++i) {
      const double time_s = solved.duration_s() * i / 50;
      EXPECT_LT((solved.at(time_s).position - slowed.at(time_s).position).norm(), 1e-9);
      EXPECT_LT((solved.at(time_s).velocity - slowed.at(time_s).velocity).norm(), 1e-9);
    }
  }
}

TEST(LeastSnap, APointOnTheWayChangesNothing) {
  const Vector3d from(-5.0, 2.0, 9.0), to(40.0, -13.0, 21.0);
  const LeastSnapCurve one({from, to}, {4.0}, false);
  for (const double time_s : {0.6, 2.0, 3.1}) {
    const LeastSnapCurve two({from, one.at(time_s).position, to}, {time_s, 4.0 - time_s}, false);
    EXPECT_NEAR(two.cost() / one.cost(), 1.0, 1e-11);
    for (int i = 0; i <= 40; ++i) {
      const LeastSnapCurve::Value a = one.at(i / 10.0), b = two.at(i / 10.0);
      EXPECT_LT((a.position - b.position).norm(), 1e-11);
      EXPECT_LT((a.velocity - b.velocity).norm(), 1e-10);
      EXPECT_LT((a.jerk - b.jerk).norm(), 1e-9);
      EXPECT_LT((a.snap - b.snap).norm(), 1e-8);
    }
  }
}

TEST(LeastSnap, PassesThePointsInTimeAndBeginsAndEndsAtRest) {
  const Walk walk = random_walk(12, 5);
  const LeastSnapCurve curve(walk.points, walk.durations_s, false);
  for (std::size_t i = 0; i < walk.points.size(); ++i)
    EXPECT_LT((curve.at(curve.knots_s()[i]).position - walk.points[i]).norm(), 1e-9) << i;
  for (const double time_s : {0.0, curve.duration_s()}) {
    const LeastSnapCurve::Value at = curve.at(time_s);
    EXPECT_LT(at.velocity.norm(), 1e-10);
    EXPECT_LT(at.acceleration.norm(), 1e-10);
    EXPECT_LT(at.jerk.norm(), 1e-9);
  }
}

// A variation of a free velocity, acceleration or jerk leaves the integral as it is just where the sixth, fifth and fourth derivatives
// do not jump: Euler and Lagrange's conditions.
TEST(LeastSnap, KeepsTheConditionsOfAMinimum) {
  for (const bool is_closed : {false, true})
    for (const int num_legs : {3, 7, 40}) {
      const Walk walk = random_walk(num_legs, 10 + static_cast<unsigned>(num_legs), is_closed);
      const LeastSnapCurve curve(walk.points, walk.durations_s, is_closed);
      EXPECT_LT(curve.stationarity(), 1e-10) << num_legs;
      const std::size_t n = curve.num_pieces();
      for (std::size_t i = is_closed ? 0 : 1; i < n; ++i)
        for (int order = 0; order <= 6; ++order)
          for (int axis = 0; axis < 3; ++axis) {
            const std::size_t before = (i + n - 1) % n;
            const double size =
                std::max(size_of(curve, before, axis, order), size_of(curve, i, axis, order));
            EXPECT_NEAR(derivative_at(curve, before, axis, order, 1.0),
                        derivative_at(curve, i, axis, order, 0.0), 1e-9 * size)
                << "point " << i << ", derivative " << order;
          }
    }
}

TEST(LeastSnap, OtherDerivativesAtAPointCostMore) {
  // Through a middle that is passed otherwise: pieces of degree 7 of which one is moved at its end.
  const Walk walk = random_walk(2, 77);
  const LeastSnapCurve curve(walk.points, walk.durations_s, false);
  std::mt19937 random(1);
  std::normal_distribution<double> change;
  for (int tries = 0; tries < 20; ++tries) {
    // h changes velocity, acceleration and jerk at the middle of both pieces alike, and nothing else.
    const Vector3d by(change(random), change(random), change(random));
    double added = 0.0, cross = 0.0;
    for (std::size_t piece = 0; piece < 2; ++piece) {
      const double T = curve.piece_s(piece), sign = piece == 0 ? -1.0 : 1.0;
      // By y = distance from the middle over T: h = T v y + T^2 a y^2 / 2 + T^3 j y^3 / 6 + …, 0 with three derivatives at 1.
      const double e1 = sign * T * by.x(), e2 = T * T * by.y(), e3 = sign * T * T * T * by.z();
      const double d = -(e1 + e2 / 2 + e3 / 6), e = -(e1 + e2 + e3 / 2), f = -(e2 + e3), g = -e3;
      const Polynomial h = {0.0,
                            e1,
                            e2 / 2,
                            e3 / 6,
                            35 * d - 15 * e + 2.5 * f - g / 6,
                            -84 * d + 39 * e - 7 * f + g / 2,
                            70 * d - 34 * e + 6.5 * f - g / 2,
                            -20 * d + 10 * e - 2 * f + g / 6};
      Polynomial snap = h, mine = curve.coordinate_of(piece, 0);
      for (int i = 0; i < 4; ++i) {
        snap = derivative_of(snap);
        mine = derivative_of(mine);
      }
      constexpr int kSteps = 2000;
      for (int i = 0; i < kSteps; ++i) {
        const double y = (i + 0.5) / kSteps;
        const double scale = 1.0 / std::pow(T, 7) / kSteps;
        added += value_of(snap, y) * value_of(snap, y) * scale;
        cross += 2.0 * value_of(snap, y) * value_of(mine, piece == 0 ? 1.0 - y : y) * scale;
      }
    }
    EXPECT_GT(added, 0.0);
    // The midpoint rule of 2000 steps is good to 1e-6.
    EXPECT_LT(std::abs(cross), 1e-5 * std::sqrt(added * curve.cost()));
  }
}

TEST(LeastSnap, SlopesOfTheCostAreDifferencesOfTheCost) {
  for (const bool is_closed : {false, true}) {
    const Walk walk = random_walk(5, 21, is_closed);
    const std::vector<double> slopes =
        LeastSnapCurve(walk.points, walk.durations_s, is_closed).cost_slopes();
    for (std::size_t i = 0; i < slopes.size(); ++i) {
      const double step_s = 1e-4 * walk.durations_s[i];
      std::vector<double> more = walk.durations_s, less = walk.durations_s;
      more[i] += step_s;
      less[i] -= step_s;
      const double difference = (LeastSnapCurve(walk.points, more, is_closed).cost() -
                                 LeastSnapCurve(walk.points, less, is_closed).cost()) /
                                (2.0 * step_s);
      EXPECT_NEAR(slopes[i] / difference, 1.0, 1e-5) << i;
    }
  }
}

TEST(LeastSnap, DirectionsAreThoseOfTheVelocityAlsoAtRest) {
  for (const int num_legs : {1, 2, 5}) {
    const Walk walk = random_walk(num_legs, 31);
    const LeastSnapCurve curve(walk.points, walk.durations_s, false);
    for (std::size_t piece = 0; piece < curve.num_pieces(); ++piece)
      for (int i = 0; i <= 20; ++i) {
        // A ten thousandth from rest the velocity is 1e-10 of its size.
        const double x = std::clamp(i / 20.0, 0.01, 0.99);
        Vector3d direction;
        for (int axis = 0; axis < 3; ++axis)
          direction[axis] = value_of(curve.direction_of(piece, axis), x);
        const Vector3d velocity =
            curve.at(curve.knots_s()[piece] + x * curve.piece_s(piece)).velocity;
        EXPECT_LT((direction.normalized() - velocity.normalized()).norm(), 1e-6)
            << piece << " " << x;
      }
    Vector3d first, last;
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = value_of(curve.direction_of(0, axis), 0.0);
      last[axis] = value_of(curve.direction_of(curve.num_pieces() - 1, axis), 1.0);
    }
    EXPECT_GT(first.norm(), 1e-3);
    EXPECT_GT(last.norm(), 1e-3);
  }
}

TEST(SegmentTimes, PeaksAreTheTrueOnes) {
  const Walk walk = random_walk(8, 41);
  const LeastSnapCurve curve(walk.points, walk.durations_s, false);
  for (std::size_t piece = 0; piece < curve.num_pieces(); ++piece) {
    const PiecePeaks peaks = peaks_of(curve, piece);
    double speed = 0.0, acceleration = 0.0, jerk = 0.0;
    constexpr int kSamples = 20000;
    for (int i = 0; i <= kSamples; ++i) {
      const LeastSnapCurve::Value at =
          curve.at(curve.knots_s()[piece] +
                   curve.piece_s(piece) * std::min(i / double{kSamples}, 1.0 - 1e-12));
      speed = std::max(speed, at.velocity.norm());
      acceleration = std::max(acceleration, at.acceleration.norm());
      jerk = std::max(jerk, at.jerk.norm());
    }
    // Samples are lower by the curvature at the peak times a spacing squared.
    EXPECT_NEAR(peaks.speed_mps.size / speed, 1.0, 1e-6);
    EXPECT_NEAR(peaks.acceleration_mps2.size / acceleration, 1.0, 1e-6);
    EXPECT_NEAR(peaks.jerk_mps3.size / jerk, 1.0, 1e-6);
    EXPECT_GE(peaks.speed_mps.size, speed * (1.0 - 1e-12));
    EXPECT_NEAR(curve.at(peaks.jerk_mps3.time_s - 1e-9).jerk.norm() / peaks.jerk_mps3.size, 1.0,
                1e-6);
  }
}

TEST(SegmentTimes, ReachOneOfTheLimitsAndPassNone) {
  for (const Timing timing : {Timing::Shortest, Timing::Smoothest})
    for (const bool is_closed : {false, true})
      for (const MotionLimits& limits :
           {MotionLimits{8.0, 4.0, 15.0}, MotionLimits{3.0, 100.0, 1000.0},
            MotionLimits{100.0, 1.0, 1000.0}, MotionLimits{100.0, 100.0, 0.5}}) {
        const Walk walk = random_walk(9, 51, is_closed);
        const LeastSnapCurve curve = fit_within(walk.points, is_closed, limits, timing);
        double most = 0.0;
        for (std::size_t i = 0; i < curve.num_pieces(); ++i)
          most = std::max(most, slowing_of(peaks_of(curve, i), limits));
        EXPECT_NEAR(most, 1.0, 1e-9);
        EXPECT_LT(curve.stationarity(), 1e-10);
      }
}

TEST(SegmentTimes, OfASingleWayAreThoseOfTheClosedForm) {
  // Of s = d (35 x^4 - …): speed 35/16 d / T at the middle, acceleration d / T^2 times the largest of 420 x^2 (1-x)^2 (1-2x) x.
  const LeastSnapCurve curve =
      fit_within({{0, 0, 0}, {0, 160, 0}}, false, {7.0, 1e3, 1e4}, Timing::Shortest);
  EXPECT_NEAR(curve.duration_s(), 35.0 / 16.0 * 160.0 / 7.0, 1e-9);
}

TEST(SegmentTimes, SmoothestIsAMinimumAmongAllDealings) {
  const Walk walk = random_walk(5, 61);
  const LeastSnapCurve curve = fit_within(walk.points, false, {8.0, 4.0, 15.0}, Timing::Smoothest);
  std::mt19937 random(4);
  std::normal_distribution<double> change(0.0, 0.05);
  for (int tries = 0; tries < 50; ++tries) {
    std::vector<double> durations_s;
    double sum_s = 0.0;
    for (std::size_t i = 0; i < curve.num_pieces(); ++i) {
      durations_s.push_back(curve.piece_s(i) * std::exp(change(random)));
      sum_s += durations_s.back();
    }
    for (double& duration_s : durations_s) duration_s *= curve.duration_s() / sum_s;
    EXPECT_GE(LeastSnapCurve(walk.points, durations_s, false).cost(), curve.cost() * (1.0 - 1e-9));
  }
}

TEST(SegmentTimes, ShortestFliesLongWaysAtTheLimit) {
  // Twenty places in a gentle bend, 100 m apart: the smoothest flight would be fast in the middle alone.
  std::vector<Vector3d> points;
  for (int i = 0; i < 20; ++i)
    points.emplace_back(100.0 * i, 40.0 * std::sin(0.4 * i), 5.0 * std::cos(0.7 * i));
  const MotionLimits limits{10.0, 5.0, 20.0};
  const double smoothest_s = fit_within(points, false, limits, Timing::Smoothest).duration_s();
  const LeastSnapCurve shortest = fit_within(points, false, limits, Timing::Shortest);
  double way_m = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) way_m += (points[i] - points[i - 1]).norm();
  RecordProperty("shortest_s", fmt::format("{:.1f}", shortest.duration_s()));
  RecordProperty("smoothest_s", fmt::format("{:.1f}", smoothest_s));
  EXPECT_LT(shortest.duration_s(), 0.8 * smoothest_s);
  EXPECT_LT(shortest.duration_s(), 1.15 * way_m / limits.speed_mps);
}

}  // namespace
}  // namespace terracast::geo
