#include "geo/air/turbulence.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

constexpr TurbulenceModel kModels[] = {TurbulenceModel::Dryden, TurbulenceModel::VonKarman};
constexpr TurbulenceComponent kComponents[] = {TurbulenceComponent::Along,
                                               TurbulenceComponent::Across};

/// One-sided spectra of unit variance, as MIL-F-8785C prints them, by radians a length.
double spectrum(TurbulenceModel model, TurbulenceComponent component, double w) {
  const double pi = std::numbers::pi;
  if (model == TurbulenceModel::Dryden)
    return component == TurbulenceComponent::Along
               ? 2.0 / pi / (1.0 + w * w)
               : (1.0 + 3.0 * w * w) / pi / std::pow(1.0 + w * w, 2);
  const double s = std::pow(1.339 * w, 2);
  return component == TurbulenceComponent::Along
             ? 2.0 / pi * std::pow(1.0 + s, -5.0 / 6.0)
             : (1.0 + 8.0 / 3.0 * s) / pi * std::pow(1.0 + s, -11.0 / 6.0);
}

/// Gauss and Legendre's rule of 20 points over [begin, end], its nodes as eigenvalues of Jacobi's matrix.
double integral(const std::function<double(double)>& value, double begin, double end) {
  constexpr int kCount = 20;
  static const auto rule = [] {
    Eigen::MatrixXd jacobi = Eigen::MatrixXd::Zero(kCount, kCount);
    for (int k = 1; k < kCount; ++k)
      jacobi(k, k - 1) = jacobi(k - 1, k) = k / std::sqrt(4.0 * k * k - 1.0);
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(jacobi);
  }();
  double sum = 0.0;
  for (int k = 0; k < kCount; ++k) {
    const double x = 0.5 * (begin + end + (end - begin) * rule.eigenvalues()[k]);
    sum += std::pow(rule.eigenvectors()(0, k), 2) * value(x);
  }
  return (end - begin) * sum;
}

/// The integral of spectrum times cos(w r): its half periods alternate, and means of neighbouring partial sums, again
/// and again, are its limit (Euler).
double covariance_by_quadrature(TurbulenceModel model, TurbulenceComponent component, double r) {
  const double half_period = std::numbers::pi / r;
  const auto value = [&](double w) { return spectrum(model, component, w) * std::cos(w * r); };
  std::vector<double> sums;
  double sum = 0.0, begin = 0.0;
  for (int i = 0; i < 80; ++i) {
    const double end = (i + 0.5) * half_period;
    const int parts = i == 0 ? 40 : 3;  // the spectrum bends where w is about 1
    for (int k = 0; k < parts; ++k)
      sum += integral(value, begin + (end - begin) * k / parts,
                      begin + (end - begin) * (k + 1) / parts);
    begin = end;
    if (i >= 20) sums.push_back(sum);
  }
  while (sums.size() > 1) {
    for (std::size_t i = 0; i + 1 < sums.size(); ++i) sums[i] = 0.5 * (sums[i] + sums[i + 1]);
    sums.pop_back();
  }
  return sums.front();
}

// The standard's 1.339 is rounded, which makes the variance of von Karman's spectra 1 - 1.1e-5.
TEST(Turbulence, CovariancesAreTheTransformsOfTheStandardsSpectra) {
  const double exact_scale =
      std::tgamma(1.0 / 3.0) / (std::sqrt(std::numbers::pi) * std::tgamma(5.0 / 6.0));
  EXPECT_NEAR(exact_scale, 1.339, 5e-4);
  for (const TurbulenceModel model : kModels)
    for (const TurbulenceComponent component : kComponents) {
      const double variance = model == TurbulenceModel::Dryden ? 1.0 : exact_scale / 1.339;
      EXPECT_EQ(turbulence_covariance(model, component, 0.0), 1.0);
      for (const double r : {0.05, 0.5, 1.0, 2.0, 5.0})
        EXPECT_NEAR(variance * turbulence_covariance(model, component, r),
                    covariance_by_quadrature(model, component, r), 1e-10)
            << r;
    }
}

TEST(Turbulence, DrydensDiscreteCovariancesAreThoseOfItsSpectrum) {
  for (const TurbulenceComponent component : kComponents)
    for (const double step : {UnitTurbulence::kSpacing, 0.3}) {
      const ShapingFilter filter = dryden_filter(component, step);
      // One step keeps the stationary covariance, and k steps correlate as the spectrum says.
      EXPECT_LT((filter.transition * filter.stationary * filter.transition.transpose() +
                 filter.noise - filter.stationary)
                    .norm(),
                1e-15);
      ShapingFilter::Matrix moved = filter.stationary;
      const int counts[] = {0, 1, 2, 7, static_cast<int>(2.0 / step)};
      int k = 0;
      for (const int count : counts) {
        for (; k < count; ++k) moved = (filter.transition * moved).eval();
        const double covariance = filter.output.dot(moved * filter.output);
        const double expected =
            k == 0 ? 1.0
            : k * step < 0.02
                ? turbulence_covariance(TurbulenceModel::Dryden, component, k * step)
                : covariance_by_quadrature(TurbulenceModel::Dryden, component, k * step);
        EXPECT_NEAR(covariance, expected, 1e-10) << k;
      }
    }
}

// The integral over the step of exp(A s) B B' exp(A' s), with exp(A s) B = (s, 1 - s) exp(-s) of the filter across.
TEST(Turbulence, DrydensNoiseOfAStepIsTheIntegralOfItsResponse) {
  for (const double step : {UnitTurbulence::kSpacing, 0.3, 2.0}) {
    const ShapingFilter filter = dryden_filter(TurbulenceComponent::Across, step);
    const auto entry = [&](int i, int k) {
      return integral(
          [&](double s) {
            const double response[] = {s * std::exp(-s), (1.0 - s) * std::exp(-s)};
            return response[i] * response[k];
          },
          0.0, step);
    };
    for (int i = 0; i < 2; ++i)
      for (int k = 0; k < 2; ++k) EXPECT_NEAR(filter.noise(i, k), entry(i, k), 1e-15);
  }
}

// Four deviations of the estimate: of N independent values, sqrt(2 / N) of the variance.
TEST(Turbulence, DrawnLinesHaveTheVarianceAndTheCovariancesOfTheirSpectra) {
  constexpr double kLengths = 1500.0;
  for (const TurbulenceModel model : kModels)
    for (const TurbulenceComponent component : kComponents) {
      const UnitTurbulence line(model, component, kLengths, 11, 5);
      const std::vector<double>& nodes = line.nodes();
      const double band = 4.0 * std::sqrt(2.0 / (kLengths / 2.0));
      for (const int lag : {0, 1, 64, 128, 256, 512}) {
        double sum = 0.0;
        const std::size_t count = nodes.size() - static_cast<std::size_t>(lag);
        for (std::size_t i = 0; i < count; ++i)
          sum += nodes[i] * nodes[i + static_cast<std::size_t>(lag)];
        EXPECT_NEAR(sum / static_cast<double>(count),
                    turbulence_covariance(model, component, lag * UnitTurbulence::kSpacing), band)
            << lag;
      }
      // Steps are nearly independent of each other, and known far better.
      double steps = 0.0;
      for (std::size_t i = 1; i < nodes.size(); ++i) steps += std::pow(nodes[i] - nodes[i - 1], 2);
      const double expected =
          2.0 - 2.0 * turbulence_covariance(model, component, UnitTurbulence::kSpacing);
      EXPECT_NEAR(steps / static_cast<double>(nodes.size() - 1) / expected, 1.0, 0.02);
    }
}

// At fixed places, over many seeds (Dryden: the start is stationary, and neighbours covary from the first node on), and
// in windows that lie apart (von Karman, whose lines cost more).
TEST(Turbulence, LinesOfManySeedsCovaryAtFixedPlaces) {
  constexpr int kWindows = 400;
  constexpr double kApart = 5.0;  // lengths, over which hardly anything covaries
  const UnitTurbulence long_line(TurbulenceModel::VonKarman, TurbulenceComponent::Across,
                                 kApart * (kWindows + 1), 3, 0);
  for (const TurbulenceModel model : kModels) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    const double places[] = {0.0, 0.4, 1.5};
    for (int window = 0; window < kWindows; ++window) {
      Eigen::Vector3d values;
      if (model == TurbulenceModel::Dryden) {
        const UnitTurbulence line(model, TurbulenceComponent::Across, 1.5, window, 0);
        values << line.at(places[0]), line.at(places[1]), line.at(places[2]);
      } else {
        for (int i = 0; i < 3; ++i) values[i] = long_line.at(kApart * window + places[i]);
      }
      sum += values * values.transpose();
    }
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(sum(i, k) / kWindows,
                    turbulence_covariance(model, TurbulenceComponent::Across,
                                          std::abs(places[i] - places[k])),
                    4.0 * std::sqrt(2.0 / kWindows));
  }
}

TEST(Turbulence, LinesPassThroughTheirNodesSmoothly) {
  const UnitTurbulence line(TurbulenceModel::Dryden, TurbulenceComponent::Along, 40.0, 3, 1);
  double variance = 0.0;
  int count = 0;
  for (double lengths = 0.5 * UnitTurbulence::kSpacing; lengths < 40.0;
       lengths += UnitTurbulence::kSpacing, ++count) {
    const auto node = static_cast<std::size_t>(lengths / UnitTurbulence::kSpacing);
    const double* nodes = &line.nodes()[node + UnitTurbulence::kBeyond];
    ASSERT_EQ(line.at(static_cast<double>(node) * UnitTurbulence::kSpacing), nodes[0]);
    // In the middle: the mean of the two, less or more by a share of the steps around.
    variance += std::pow(line.at(lengths) - 0.5 * (nodes[0] + nodes[1]), 2);
  }
  EXPECT_LT(variance / count, 0.2 * 2.0 * UnitTurbulence::kSpacing);
  // Both sides of a node agree, with their slopes.
  const double node = 1000 * UnitTurbulence::kSpacing, near = 1e-7;
  EXPECT_NEAR(line.at(node + near) - line.at(node), line.at(node) - line.at(node - near), 1e-8);
}

// Half way between nodes, against the nodes on both sides: what the curve through them loses.
TEST(Turbulence, BetweenNodesLittleOfTheVarianceIsLost) {
  constexpr double kLengths = 1500.0;
  for (const TurbulenceModel model : kModels)
    for (const TurbulenceComponent component : kComponents) {
      const UnitTurbulence line(model, component, kLengths, 17, 2);
      double between = 0.0, at_nodes = 0.0;
      for (std::size_t i = 0; i + 1 < static_cast<std::size_t>(kLengths / UnitTurbulence::kSpacing);
           ++i) {
        const double* node = &line.nodes()[i + UnitTurbulence::kBeyond];
        between += std::pow(line.at((static_cast<double>(i) + 0.5) * UnitTurbulence::kSpacing), 2);
        at_nodes += 0.5 * (node[0] * node[0] + node[1] * node[1]);
      }
      // Of 384 000 differences, each known to a tenth: 0.0003.
      const double lost = 1.0 - between / at_nodes;
      EXPECT_NEAR(lost, 0.0, (model == TurbulenceModel::Dryden ? 0.001 : 0.005) + 4.0 * 0.0003);
      EXPECT_GT(lost, -0.001);
    }
}

TEST(Turbulence, IsTheSameForLongerWaysAndOtherForOtherSeeds) {
  for (const TurbulenceModel model : kModels) {
    const UnitTurbulence shorter(model, TurbulenceComponent::Across, 20.0, 1, 0);
    const UnitTurbulence longer(model, TurbulenceComponent::Across, 90.0, 1, 0);
    const UnitTurbulence other(model, TurbulenceComponent::Across, 20.0, 2, 0);
    EXPECT_EQ(shorter.at(13.37), longer.at(13.37));
    EXPECT_NE(shorter.at(13.37), other.at(13.37));
    EXPECT_NE(test::message_of(core::ErrorKind::Input,
                               [&] { UnitTurbulence(model, kComponents[0], 1e5, 1, 0); })
                  .find("fly a shorter way, or higher"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace terracast::geo
