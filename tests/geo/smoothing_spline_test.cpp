#include "geo/paths/smoothing_spline.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

namespace terracast::geo {
namespace {

std::vector<double> uneven_times(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> step(0.3, 2.0);
  std::vector<double> times(1, 0.0);
  while (static_cast<int>(times.size()) < count) times.push_back(times.back() + step(random));
  return times;
}

Eigen::MatrixXd noise(int rows, int columns, double sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, sigma);
  Eigen::MatrixXd values(rows, columns);
  for (Eigen::Index i = 0; i < values.size(); ++i) values(i) = normal(random);
  return values;
}

/// Integral of the products of second derivatives of all natural cubic splines that are one at a knot
/// and nought at the others, by solving each spline's own equations without any bands.
Eigen::MatrixXd roughness_matrix(const std::vector<double>& t) {
  const auto n = static_cast<Eigen::Index>(t.size());
  Eigen::MatrixXd equations = Eigen::MatrixXd::Zero(n, n), slopes = Eigen::MatrixXd::Zero(n, n);
  equations(0, 0) = equations(n - 1, n - 1) = 1.0;
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const double before = t[i] - t[i - 1], after = t[i + 1] - t[i];
    equations(i, i - 1) = before / 6.0;
    equations(i, i) = (before + after) / 3.0;
    equations(i, i + 1) = after / 6.0;
    slopes(i, i - 1) = 1.0 / before;
    slopes(i, i) = -1.0 / before - 1.0 / after;
    slopes(i, i + 1) = 1.0 / after;
  }
  // Second derivatives at the knots for unit values; they are linear between knots.
  const Eigen::MatrixXd second = equations.fullPivLu().solve(slopes);
  Eigen::MatrixXd roughness = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    const double h = t[i + 1] - t[i];
    const Eigen::RowVectorXd a = second.row(i), b = second.row(i + 1);
    roughness += h / 3.0 * (a.transpose() * a + b.transpose() * b) +
                 h / 6.0 * (a.transpose() * b + b.transpose() * a);
  }
  return roughness;
}

TEST(SmoothingSpline, IsTheMinimumThatADenseSolverFinds) {
  const std::vector<double> times = uneven_times(40, 1);
  const Eigen::MatrixXd values = noise(40, 3, 5.0, 2);
  std::vector<double> weights;
  for (int i = 0; i < 40; ++i) weights.push_back(i % 7 == 0 ? 0.01 : 0.5 + 0.01 * i);
  const Eigen::MatrixXd w =
      Eigen::Map<const Eigen::VectorXd>(weights.data(), 40).asDiagonal().toDenseMatrix();
  for (const double lambda : {1e-3, 1.0, 300.0}) {
    const Eigen::MatrixXd expected =
        (w + lambda * roughness_matrix(times)).ldlt().solve(w * values);
    const Eigen::MatrixXd found = smooth_values(times, values, weights, lambda);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-9) << lambda;
  }
}

TEST(SmoothingSpline, BecomesTheRegressionLineAndTheValuesThemselves) {
  const std::vector<double> times = uneven_times(50, 3);
  Eigen::MatrixXd line(50, 1);
  for (int i = 0; i < 50; ++i) line(i, 0) = 3.0 - 2.0 * times[static_cast<std::size_t>(i)];
  const std::vector<double> weights(50, 1.0);
  const Eigen::MatrixXd values = line + noise(50, 1, 1.0, 4);
  Eigen::MatrixXd design(50, 2);
  for (int i = 0; i < 50; ++i) design.row(i) << 1.0, times[static_cast<std::size_t>(i)];
  const Eigen::MatrixXd regression =
      design * (design.transpose() * design).ldlt().solve(design.transpose() * values);
  EXPECT_LT((smooth_values(times, values, weights, 1e9) - regression).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_EQ(smooth_values(times, values, weights, 0.0), values);
  EXPECT_LT((smooth_values(times, values, weights, 1e-9) - values).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(SmoothingSpline, KeepsItsDigitsOverAHundredKnots) {
  // Reinsch's system at even steps, in extended precision and without bands.
  using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  constexpr int kCount = 300;
  std::vector<double> times;
  for (int i = 0; i < kCount; ++i) times.push_back(i);
  Eigen::MatrixXd values = noise(kCount, 1, 1.0, 9);
  for (int i = 0; i < kCount; ++i) values(i, 0) += 100.0 * std::sin(i / 20.0);
  Matrix q = Matrix::Zero(kCount, kCount - 2), r = Matrix::Zero(kCount - 2, kCount - 2);
  for (int k = 0; k < kCount - 2; ++k) {
    q(k, k) = q(k + 2, k) = 1.0L;
    q(k + 1, k) = -2.0L;
    r(k, k) = 2.0L / 3.0L;
    if (k > 0) r(k, k - 1) = r(k - 1, k) = 1.0L / 6.0L;
  }
  constexpr long double kLambda = 1e8L;
  const Matrix system = r + kLambda * q.transpose() * q;
  const Matrix given = values.cast<long double>();
  const Matrix expected = given - kLambda * q * system.ldlt().solve(q.transpose() * given);
  const std::vector<double> weights(kCount, 1.0);
  const Eigen::MatrixXd found = smooth_values(times, values, weights, static_cast<double>(kLambda));
  EXPECT_LT((found - expected.cast<double>()).cwiseAbs().maxCoeff(), 1e-10 * 200.0);
}

/// A turning flight of 20 m/s, a fix a second, and its noise.
struct NoisyFlight {
  std::vector<double> times;
  Eigen::MatrixXd truth, values;
};

NoisyFlight noisy_flight(double sigma) {
  NoisyFlight flight;
  constexpr int kCount = 600;
  flight.truth.resize(kCount, 2);
  for (int i = 0; i < kCount; ++i) {
    flight.times.push_back(i);
    flight.truth.row(i) << 300.0 * std::sin(i / 15.0), 10.0 * i;
  }
  flight.values = flight.truth + noise(kCount, 2, sigma, 5);
  return flight;
}

double rms(const Eigen::MatrixXd& difference) {
  return std::sqrt(difference.squaredNorm() / static_cast<double>(difference.size()));
}

TEST(RobustSmoothing, LeavesResidualsOfTheStatedSigmaAndComesNearerToTheTruth) {
  const NoisyFlight flight = noisy_flight(3.0);
  const Smoothed smooth = smooth_robustly(flight.times, flight.values, 3.0);
  EXPECT_NEAR(smooth.rms, 3.0, 0.15);  // the bound of outliers takes a little of Gauss's tails
  // With residuals of sigma the bias is as large as the noise that is left: on this turn, over some
  // seven fixes, about half of sigma each way.
  EXPECT_LT(rms(smooth.values - flight.truth), 0.6 * 3.0);
  EXPECT_LT(smooth.num_outliers, 15u);
}

TEST(RobustSmoothing, OutliersMoveItLittle) {
  NoisyFlight flight = noisy_flight(3.0);
  const double without =
      rms(smooth_robustly(flight.times, flight.values, 3.0).values - flight.truth);
  for (int i = 10; i < 600; i += 30) flight.values(i, 0) += i % 60 == 10 ? 120.0 : -80.0;
  const Smoothed smooth = smooth_robustly(flight.times, flight.values, 3.0);
  EXPECT_GE(smooth.num_outliers, 20u);
  EXPECT_LT(smooth.num_outliers, 35u);
  EXPECT_LT(rms(smooth.values - flight.truth), without + 1.0);
  // Least squares with the same smoothness is drawn along.
  const std::vector<double> equal(600, 1.0);
  double best = 1e9;
  for (double lambda = 0.1; lambda < 1e5; lambda *= 2.0)
    best = std::min(best,
                    rms(smooth_values(flight.times, flight.values, equal, lambda) - flight.truth));
  EXPECT_LT(rms(smooth.values - flight.truth), 0.6 * best);
}

TEST(RobustSmoothing, AShortManoeuvreAmidLongRestIsKept) {
  // Hovers, flies 200 m within 20 s, hovers on: nine tenths of the fixes stand still.
  std::vector<double> times;
  Eigen::MatrixXd truth(200, 1);
  for (int i = 0; i < 200; ++i) {
    times.push_back(i);
    const double x = std::clamp((i - 90) / 20.0, 0.0, 1.0);
    truth(i, 0) = 200.0 * x * x * x * (10.0 + x * (6.0 * x - 15.0));
  }
  const Smoothed smooth = smooth_robustly(times, truth + noise(200, 1, 0.5, 6), 0.5);
  EXPECT_LT((smooth.values - truth).cwiseAbs().maxCoeff(), 2.0);
}

TEST(RobustSmoothing, AStartFromRestIsNoOutlier) {
  // Up to 12 m/s within six of sixty fixes.
  std::vector<double> times;
  Eigen::MatrixXd truth(60, 2);
  for (int i = 0; i < 60; ++i) {
    times.push_back(i);
    truth.row(i) << (i < 6 ? 1.0 * i * i : 12.0 * i - 36.0), 0.0;
  }
  const Smoothed smooth = smooth_robustly(times, truth + noise(60, 2, 0.3, 8), 0.3);
  const Eigen::VectorXd misses = (smooth.values - truth).rowwise().norm();
  EXPECT_LT(misses.tail(59).maxCoeff(), 5.0 * 0.3) << misses.head(8);
  EXPECT_LT(misses[0], 4.0);  // the very first has no neighbour to agree with
}

TEST(RobustSmoothing, KeepsAStraightLineAndWhatHasNoSigma) {
  const std::vector<double> times = uneven_times(100, 7);
  Eigen::MatrixXd line(100, 2);
  for (int i = 0; i < 100; ++i)
    line.row(i) << 5000.0 + 30.0 * times[static_cast<std::size_t>(i)],
        -4.0 * times[static_cast<std::size_t>(i)];
  EXPECT_LT((smooth_robustly(times, line, 2.0).values - line).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_EQ(smooth_robustly(times, line, 0.0).values, line);
}

}  // namespace
}  // namespace terracast::geo
