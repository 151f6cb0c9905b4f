#pragma once

#include <cstdint>

#include "core/random.h"

namespace terracast::sensors {

/// The standard normal deviate below which a share `unit` of all lie.
/// unit       in (0, 1)
/// accuracy   1e-6; Deviates.NormalIsTheInverseOfTheErrorFunction
/// source     Wichura 1988, Applied Statistics 37, algorithm AS 241 (PPND7)
double normal_deviate(double unit);

/// The Poisson deviate of a mean below which a share `unit` of all lie.
/// mean       0 or more
/// unit       in (0, 1)
/// accuracy   means below 32: exact, to the rounding of double; from there on the asymptotic expansion of
///            Giles 2016, ACM Transactions on Mathematical Software 42(1), which puts less than 0.1 / mean of
///            all draws one count beside; Deviates.PoissonHasItsShares
double poisson_deviate(double mean, double unit);

/// Uniform in (0, 1): the middles of 2^53 equal parts.
inline double open_unit(std::uint64_t bits) {
  return (static_cast<double>(bits >> 11) + 0.5) * 0x1.0p-53;
}

}  // namespace terracast::sensors
