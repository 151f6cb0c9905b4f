#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace terracast::geo {

/// The values at its knots of the natural cubic spline g that makes
///     sum over i of weights[i] |values(i) - g(times_s[i])|^2 + lambda_s3 * integral of |g''|^2
/// least. lambda_s3 = 0 gives the values themselves, a large one the weighted straight line.
/// times_s    increasing, as many as values has rows
/// values     one row a time, one column a coordinate
/// weights    positive
/// accuracy   1e-10 of the values' spread when smoothing over a hundred knots, 2e-8 over three
///            hundred, against extended precision
/// cost       100 ns a value
/// source     Green and Silverman, Nonparametric Regression (1994), section 2.3: Reinsch's system for
///            the second derivatives, solved by its five bands
Eigen::MatrixXd smooth_values(std::span<const double> times_s, const Eigen::MatrixXd& values,
                              std::span<const double> weights, double lambda_s3);

/// Noisy values made smooth.
struct Smoothed {
  Eigen::MatrixXd values;         ///< at the knots
  std::vector<double> residuals;  ///< distance of each given value to its smooth one
  double rms = 0.0;               ///< of the residuals within 3 sigma, for each coordinate
  std::size_t num_outliers = 0;   ///< residuals beyond 3 sigma
};

/// The smoothest motion whose residuals are what `sigma` says: least integral of |g''|^2 such that the
/// mean of the squared residuals, each bounded by 3 sigma, is sigma^2 in each coordinate. A value that
/// lies farther than 2 sigma away pulls no harder than one at 2 sigma does (Huber's weights: one
/// minimum, whatever the start). Only where three neighbours in a row, or two at an end, lie off to the
/// same side are they believed, and pull until the motion comes within 3 sigma: an outlier stands
/// alone, a short manoeuvre amid a long even flight does not.
/// sigma      standard deviation of one coordinate's noise; 0: the values are kept
/// cost       10 us a value
/// The same bits for the same input. Threads: safe.
Smoothed smooth_robustly(std::span<const double> times_s, const Eigen::MatrixXd& values,
                         double sigma);

}  // namespace terracast::geo
