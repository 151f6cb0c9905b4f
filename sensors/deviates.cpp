#include "sensors/deviates.h"

#include <algorithm>
#include <cmath>

namespace terracast::sensors {
namespace {

constexpr double kExactBelow = 32.0;
/// A deviate of a mean below kExactBelow is larger with a chance of less than 2^-53.
constexpr int kMostOfSmallMeans = 128;

double exact_poisson_deviate(double mean, double unit) {
  double chance = std::exp(-mean);
  double left = unit - chance;
  int count = 0;
  while (left >= 0.0 && count < kMostOfSmallMeans) {
    ++count;
    chance *= mean / count;
    left -= chance;
  }
  return count;
}

}  // namespace

double normal_deviate(double unit) {
  const double q = unit - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * (((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179) /
           (((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0);
  }
  double r = std::sqrt(-std::log(q < 0.0 ? unit : 1.0 - unit));
  double deviate;
  if (r <= 5.0) {
    r -= 1.6;
    deviate = (((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777) /
              ((0.12021132975 * r + 0.73700164250) * r + 1.0);
  } else {
    r -= 5.0;
    deviate = (((0.017337203997 * r + 0.42868294337) * r + 3.0812263860) * r + 6.6579051150) /
              ((0.012258202635 * r + 0.24197894225) * r + 1.0);
  }
  return q < 0.0 ? -deviate : deviate;
}

double poisson_deviate(double mean, double unit) {
  if (mean <= 0.0) return 0.0;
  if (mean < kExactBelow) return exact_poisson_deviate(mean, unit);
  const double w = normal_deviate(unit);
  const double root = std::sqrt(mean);
  return std::max(
      std::floor(mean + root * w + 1.0 / 3.0 + w * w / 6.0 - (w + w * w * w / 2.0) / (36.0 * root)),
      0.0);
}

}  // namespace terracast::sensors
