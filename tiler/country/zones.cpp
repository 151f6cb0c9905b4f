#include "tiler/country/zones.h"

#include <cmath>

#include "core/random.h"
#include "tiler/gradient_noise.h"

namespace terracast::tiler::country {
namespace {

using core::random_unit;

constexpr std::uint64_t kStream = 0x6c6f7473;

/// Quarters of industry are some hundred metres wide, with others between them.
bool is_quarter(const Point& at, std::uint64_t seed) {
  constexpr double kPeriod_m = 1100.0;
  const GradientNoise quarters(seed, kStream + 4);
  return fractal_noise(quarters, at.x() / kPeriod_m, at.y() / kPeriod_m, 2) > -0.04;
}

}  // namespace

Zone zone_of(const Settlement& town, const Point& at, double far, std::uint64_t seed) {
  if (town.rank == Rank::Hamlet) return Zone::Houses;
  if (town.rank == Rank::Village)
    return far < 0.22 && town.population > 900 ? Zone::Mixed : Zone::Houses;
  // Industry in one direction from the middle, business in another, offset by the seed.
  const Point out = (at - town.center).normalized();
  const Point industry =
      turned(Point(core::random_bits(seed, kStream, 1) % 2 == 0 ? 1.0 : -1.0, 0.0),
             2.0 * random_unit(seed, kStream, 2) - 1.0);
  if (far > 0.5 && out.dot(industry) > 0.82 && is_quarter(at, seed)) return Zone::Industry;
  if (town.rank == Rank::City) {
    const Point business = left_of(industry);
    if (far > 0.06 && far < 0.3 && out.dot(business) > 0.72) return Zone::Business;
    if (far < 0.16) return Zone::Center;
    if (far < 0.4) return Zone::Dense;
    if (far < 0.6)
      return random_unit(
                 seed, kStream + 3,
                 static_cast<std::uint64_t>(std::llround(std::floor(at.x() / 420.0) * 4096 +
                                                         std::floor(at.y() / 420.0) + 1e9))) < 0.45
                 ? Zone::Slabs
                 : Zone::Mixed;
    return far < 0.75 ? Zone::Mixed : Zone::Houses;
  }
  if (far < 0.22) return Zone::Center;
  if (far < 0.34 && town.population > 9000) return Zone::Dense;
  return far < 0.5 ? Zone::Mixed : Zone::Houses;
}

}  // namespace terracast::tiler::country
