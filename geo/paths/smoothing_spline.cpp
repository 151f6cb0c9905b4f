#include "geo/paths/smoothing_spline.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::geo {
namespace {

constexpr double kPullBound_sigma = 2.0;
constexpr double kOutlier_sigma = 3.0;

/// The second differences over uneven steps: row k of Q^T has these three weights on values k, k + 1
/// and k + 2.
struct SecondDifference {
  double first, middle, last;
};

std::vector<SecondDifference> second_differences(std::span<const double> steps) {
  std::vector<SecondDifference> rows(steps.size() - 1);
  for (std::size_t k = 0; k < rows.size(); ++k)
    rows[k] = {1.0 / steps[k], -1.0 / steps[k] - 1.0 / steps[k + 1], 1.0 / steps[k + 1]};
  return rows;
}

/// Solves a symmetric positive definite system of five bands for all columns of `right`.
/// diagonal, above, far_above   of the matrix; the last one and two of the latter are not used
void solve_five_bands(std::vector<double> diagonal, std::vector<double> above,
                      std::vector<double> far_above, Eigen::MatrixXd& right) {
  const auto count = static_cast<Eigen::Index>(diagonal.size());
  // L D L^T: `above` and `far_above` become the columns of L.
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (k >= 1) {
      diagonal[i] -= diagonal[i - 1] * above[i - 1] * above[i - 1];
      above[i] -= diagonal[i - 1] * above[i - 1] * far_above[i - 1];
    }
    if (k >= 2) diagonal[i] -= diagonal[i - 2] * far_above[i - 2] * far_above[i - 2];
    above[i] /= diagonal[i];
    far_above[i] /= diagonal[i];
    if (k >= 1) right.row(k) -= above[i - 1] * right.row(k - 1);
    if (k >= 2) right.row(k) -= far_above[i - 2] * right.row(k - 2);
  }
  for (Eigen::Index k = count - 1; k >= 0; --k) {
    const auto i = static_cast<std::size_t>(k);
    right.row(k) /= diagonal[i];
    if (k + 1 < count) right.row(k) -= above[i] * right.row(k + 1);
    if (k + 2 < count) right.row(k) -= far_above[i] * right.row(k + 2);
  }
}

std::vector<double> residual_lengths(const Eigen::MatrixXd& values, const Eigen::MatrixXd& smooth) {
  std::vector<double> lengths(static_cast<std::size_t>(values.rows()));
  for (Eigen::Index i = 0; i < values.rows(); ++i)
    lengths[static_cast<std::size_t>(i)] = (values.row(i) - smooth.row(i)).norm();
  return lengths;
}

/// Iteratively reweighted smoothing for one lambda.
class RobustFit {
 public:
  RobustFit(std::span<const double> times_s, const Eigen::MatrixXd& values, double sigma)
      : times_s_(times_s),
        values_(values),
        // A length of a residual in d coordinates is sqrt(d) sigma.
        length_sigma_(sigma * std::sqrt(static_cast<double>(values.cols()))),
        trust_(times_s.size(), 1.0),
        weights_(times_s.size(), 1.0) {}

  /// Goes on from the weights of the fit before.
  void fit(double lambda_s3, int most_rounds) {
    constexpr double kSettled = 1e-6;
    double change = 1.0;
    for (int round = 0; round < most_rounds && change > kSettled; ++round) {
      smooth_ = smooth_values(times_s_, values_, weights_, lambda_s3);
      lengths_ = residual_lengths(values_, smooth_);
      change = 0.0;
      for (std::size_t i = 0; i < weights_.size(); ++i) {
        const double bound = kPullBound_sigma * length_sigma_;
        const double weight = trust_[i] * (lengths_[i] > bound ? bound / lengths_[i] : 1.0);
        change = std::max(change, std::abs(weight - weights_[i]) / trust_[i]);
        weights_[i] = weight;
      }
    }
  }

  /// Trusts fixes more that agree with their neighbours against the motion: those are no outliers but
  /// a manoeuvre that the motion cuts off.
  /// returns   whether there are any
  bool trust_manoeuvres() {
    constexpr double kMoreTrust = 4.0, kMostTrust = 1e6;
    std::vector<double> trust = trust_;
    bool has_any = false;
    for (std::size_t i = 0; i < trust.size(); ++i) {
      if (lengths_[i] <= kOutlier_sigma * length_sigma_ || trust_[i] >= kMostTrust) continue;
      // Both neighbours, or two on one side, lie off to the same side.
      const auto agrees = [&](std::ptrdiff_t offset) { return lies_off_like(i, offset); };
      const bool is_first = i == 0, is_last = i + 1 == trust.size();
      if (!(agrees(-1) && agrees(1)) && !(agrees(1) && agrees(2)) && !(agrees(-1) && agrees(-2)) &&
          !(is_first && agrees(1)) && !(is_last && agrees(-1)))
        continue;
      trust[i] *= kMoreTrust;
      has_any = true;
    }
    trust_ = std::move(trust);
    return has_any;
  }

  /// Mean of the bounded squared residuals over what sigma says.
  double misfit() const {
    double sum = 0.0;
    for (const double length : lengths_)
      sum += std::min(length / length_sigma_, kOutlier_sigma) *
             std::min(length / length_sigma_, kOutlier_sigma);
    return sum / static_cast<double>(lengths_.size());
  }

  Smoothed result() const {
    Smoothed result{.values = smooth_, .residuals = lengths_, .rms = 0.0, .num_outliers = 0};
    double sum = 0.0;
    for (const double length : lengths_) {
      if (length > kOutlier_sigma * length_sigma_)
        ++result.num_outliers;
      else
        sum += length * length;
    }
    const auto num_inliers = static_cast<double>(lengths_.size() - result.num_outliers);
    if (num_inliers > 0.0)
      result.rms = std::sqrt(sum / num_inliers / static_cast<double>(values_.cols()));
    return result;
  }

 private:
  /// The fix that is `offset` from another lies off the motion to the same side, by half as much as an
  /// outlier or more.
  bool lies_off_like(std::size_t index, std::ptrdiff_t offset) const {
    const std::ptrdiff_t other = static_cast<std::ptrdiff_t>(index) + offset;
    if (other < 0 || other >= values_.rows()) return false;
    const double length = lengths_[static_cast<std::size_t>(other)];
    if (length < 0.5 * kOutlier_sigma * length_sigma_) return false;
    const auto residual = [&](Eigen::Index i) { return values_.row(i) - smooth_.row(i); };
    constexpr double kLeastCosine = 0.7;
    return residual(static_cast<Eigen::Index>(index)).dot(residual(other)) >
           kLeastCosine * lengths_[index] * length;
  }

  std::span<const double> times_s_;
  const Eigen::MatrixXd& values_;
  double length_sigma_;
  std::vector<double> trust_;
  std::vector<double> weights_;
  Eigen::MatrixXd smooth_;
  std::vector<double> lengths_;
};

// The misfit grows with lambda, from nought to that of a straight line; lambda is halved in on, by
// its logarithm.
double lambda_of_sigma(RobustFit& fit, double step_s) {
  // Smoothing over a tenth of a knot does nothing; over two thousand, the bands run out of digits.
  constexpr double kLeastKnots = 0.1, kMostKnots = 2000.0;
  const double unit = std::log(step_s * step_s * step_s);
  double low = unit + 4.0 * std::log(kLeastKnots);
  double high = unit + 4.0 * std::log(kMostKnots);
  constexpr int kHalvings = 30, kRoundsOfSearch = 6;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    fit.fit(std::exp(middle), kRoundsOfSearch);
    (fit.misfit() < 1.0 ? low : high) = middle;
  }
  return std::exp(low);
}

}  // namespace

// With W the weights, gamma the second derivatives at the inner knots and R their Gram matrix, (R +
// lambda Q^T W^-1 Q) gamma = Q^T y and g = y - lambda W^-1 Q gamma.
Eigen::MatrixXd smooth_values(std::span<const double> times_s, const Eigen::MatrixXd& values,
                              std::span<const double> weights, double lambda_s3) {
  const std::size_t count = times_s.size();
  TERRACAST_CHECK(static_cast<std::size_t>(values.rows()) == count && weights.size() == count,
                  "{} times, {} values, {} weights", count, values.rows(), weights.size());
  if (count < 3 || lambda_s3 == 0.0) return values;
  std::vector<double> steps(count - 1);
  for (std::size_t i = 0; i + 1 < count; ++i) {
    steps[i] = times_s[i + 1] - times_s[i];
    TERRACAST_CHECK(steps[i] > 0.0, "time {} does not grow", i + 1);
  }
  const std::vector<SecondDifference> rows = second_differences(steps);
  const std::size_t inner = rows.size();
  std::vector<double> diagonal(inner), above(inner, 0.0), far_above(inner, 0.0);
  Eigen::MatrixXd gamma(static_cast<Eigen::Index>(inner), values.cols());
  for (std::size_t k = 0; k < inner; ++k) {
    const SecondDifference& q = rows[k];
    diagonal[k] =
        (steps[k] + steps[k + 1]) / 3.0 +
        lambda_s3 * (q.first * q.first / weights[k] + q.middle * q.middle / weights[k + 1] +
                     q.last * q.last / weights[k + 2]);
    if (k + 1 < inner)
      above[k] = steps[k + 1] / 6.0 + lambda_s3 * (q.middle * rows[k + 1].first / weights[k + 1] +
                                                   q.last * rows[k + 1].middle / weights[k + 2]);
    if (k + 2 < inner) far_above[k] = lambda_s3 * q.last * rows[k + 2].first / weights[k + 2];
    const auto i = static_cast<Eigen::Index>(k);
    gamma.row(i) =
        q.first * values.row(i) + q.middle * values.row(i + 1) + q.last * values.row(i + 2);
  }
  solve_five_bands(std::move(diagonal), std::move(above), std::move(far_above), gamma);
  Eigen::MatrixXd smooth = values;
  for (std::size_t k = 0; k < inner; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    smooth.row(i) -= lambda_s3 / weights[k] * rows[k].first * gamma.row(i);
    smooth.row(i + 1) -= lambda_s3 / weights[k + 1] * rows[k].middle * gamma.row(i);
    smooth.row(i + 2) -= lambda_s3 / weights[k + 2] * rows[k].last * gamma.row(i);
  }
  return smooth;
}

Smoothed smooth_robustly(std::span<const double> times_s, const Eigen::MatrixXd& values,
                         double sigma) {
  const std::size_t count = times_s.size();
  if (count < 3 || sigma == 0.0)
    return {.values = values,
            .residuals = std::vector<double>(count, 0.0),
            .rms = 0.0,
            .num_outliers = 0};
  // About the mean, so that the residuals keep their digits.
  const Eigen::RowVectorXd mean = values.colwise().mean();
  const Eigen::MatrixXd centred = values.rowwise() - mean;
  const double step_s = (times_s.back() - times_s.front()) / static_cast<double>(count - 1);
  RobustFit fit(times_s, centred, sigma);
  const double lambda_s3 = lambda_of_sigma(fit, step_s);
  constexpr int kMostRounds = 60, kMostTrustRounds = 12;
  fit.fit(lambda_s3, kMostRounds);
  for (int i = 0; i < kMostTrustRounds && fit.trust_manoeuvres(); ++i)
    fit.fit(lambda_s3, kMostRounds);
  Smoothed result = fit.result();
  result.values.rowwise() += mean;
  return result;
}

}  // namespace terracast::geo
