#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

/// The Allan variance of what instruments show, against the lines of their parameters.
namespace terracast::test {

/// Overlapping Allan variance over m samples of a quantity.
inline double allan_variance(const std::vector<double>& samples, std::size_t m) {
  std::vector<double> sums{0.0};
  sums.reserve(samples.size() + 1);
  for (const double sample : samples) sums.push_back(sums.back() + sample);
  double squares = 0.0;
  const std::size_t count = sums.size() - 2 * m;
  for (std::size_t k = 0; k < count; ++k) {
    const double change = (sums[k + 2 * m] - 2.0 * sums[k + m] + sums[k]) / static_cast<double>(m);
    squares += change * change;
  }
  return squares / (2.0 * static_cast<double>(count));
}

/// Compares samples with the variance of their theory at ten times, to 4 standard errors of the estimate.
/// theory   Allan variance over m samples
/// beside   share of the deviation by which the theory itself may err
inline void expect_allan_line(const std::vector<double>& samples, double rate_hz,
                              const std::function<double(double m)>& theory, double beside = 0.0) {
  for (int i = 0; i < 10; ++i) {
    const double m = std::round(std::pow(10.0, 0.3 * i - 1.0) * rate_hz);
    if (m < 1.0) continue;
    const double sigma = 1.0 / std::sqrt(2.0 * (static_cast<double>(samples.size()) / m - 1.0));
    const double share =
        std::sqrt(allan_variance(samples, static_cast<std::size_t>(m)) / theory(m));
    EXPECT_NEAR(share, 1.0, 4.0 * sigma + beside) << m / rate_hz << " s";
  }
}

/// Of white noise of a density.
inline double white_allan(double density, double rate_hz, double m) {
  return density * density * rate_hz / m;
}

/// Of a walk's density K: K^2 tau / 3, and K^2 / (6 tau rate^2) for steps instead of a line.
inline double walk_allan(double density, double rate_hz, double m) {
  return density * density * m / rate_hz * (2.0 * m * m + 1.0) / (6.0 * m * m);
}

/// Of a sampled Gauss-Markov process: the sums of its covariances within a mean and across two neighbouring ones.
inline double markov_allan(double deviation, double ticks, double m) {
  double within = m, across = 0.0;
  for (double d = 1.0; d < 2.0 * m; ++d) {
    const double kept = std::exp(-d / ticks);
    if (d < m) within += 2.0 * (m - d) * kept;
    across += (m - std::abs(m - d)) * kept;
  }
  return deviation * deviation * (within - across) / (m * m);
}

}  // namespace terracast::test
