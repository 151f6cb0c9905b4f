#include "geo/gravity.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/random.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;

constexpr double kGm_m3ps2 = 3986004.418e8;

/// Gravity of the normal field in Earth-centred axes by another way than the library's closed form: zonal harmonics, whose
/// coefficients follow from the first one and the ellipsoid (Heiskanen and Moritz 1967, 2-92), differentiated along r and
/// the latitude, and the centrifugal part.
Vector3d gravity_by_harmonics(const Vector3d& point) {
  const double r = point.norm(), s = point.z() / r;
  const double e2 = kWgs84Flattening * (2.0 - kWgs84Flattening);
  constexpr double kJ2 = 1.082629821313e-3;
  constexpr int kMost = 12;
  // Legendre's polynomials of the sine of the geocentric latitude, and their derivatives.
  std::array<double, kMost + 2> p{}, dp{};
  p[0] = 1.0;
  p[1] = s;
  dp[1] = 1.0;
  for (int n = 1; n <= kMost; ++n) {
    p[n + 1] = ((2 * n + 1) * s * p[n] - n * p[n - 1]) / (n + 1);
    dp[n + 1] = dp[n - 1] + (2 * n + 1) * p[n];
  }
  double by_r = -kGm_m3ps2 / (r * r), by_s = 0.0;
  for (int n = 1; 2 * n <= kMost; ++n) {
    const double sign = n % 2 == 0 ? -1.0 : 1.0;
    const double j =
        sign * 3.0 * std::pow(e2, n) / ((2 * n + 1) * (2 * n + 3)) * (1.0 - n + 5.0 * n * kJ2 / e2);
    const double ratio = std::pow(kWgs84SemiMajorAxis_m / r, 2 * n);
    by_r += kGm_m3ps2 / (r * r) * (2 * n + 1) * j * ratio * p[2 * n];
    by_s -= kGm_m3ps2 / r * j * ratio * dp[2 * n];
  }
  const Vector3d up = point / r;
  const Vector3d gradient_of_s = (Vector3d::UnitZ() - s * up) / r;
  return by_r * up + by_s * gradient_of_s +
         kEarthRate_radps * kEarthRate_radps * Vector3d(point.x(), point.y(), 0.0);
}

TEST(Gravity, HasWgs84sPublishedValuesOnTheEllipsoid) {
  // NIMA TR8350.2, table 3.4: at the equator and at the poles.
  for (const auto& [lat_deg, value] : {std::pair{0.0, 9.7803253359}, {90.0, 9.8321849378}}) {
    const WorldFrame frame({lat_deg, 10.0, 0.0});
    const Vector3d gravity = gravity_world_mps2(frame, Vector3d::Zero());
    EXPECT_NEAR(gravity.z(), -value, 1e-10);
    EXPECT_NEAR(gravity.head<2>().norm(), 0.0, 1e-12);
  }
}

TEST(Gravity, IsThatOfTheZonalHarmonicsAnywhere) {
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const auto unit = [&](std::uint64_t what) { return core::random_unit(3, what, i); };
    const WorldFrame frame({180.0 * unit(0) - 90.0, 360.0 * unit(1) - 180.0, 1000.0 * unit(2)});
    const Vector3d place(5e4 * unit(3) - 2.5e4, 5e4 * unit(4) - 2.5e4, 12000.0 * unit(5));
    const Vector3d expected = frame.ecef_from_world().rotation.conjugate() *
                              gravity_by_harmonics(frame.ecef_from_world() * place);
    // Six harmonics leave 1e-13; coordinates of the Earth's size are rounded to 1e-9 m.
    EXPECT_LT((gravity_world_mps2(frame, place) - expected).norm(), 1e-11) << place.transpose();
  }
}

TEST(Gravity, FallsWithTheHeightAndPointsDownOnTheEllipsoidAlone) {
  const WorldFrame frame({42.5, 1.5, 0.0});
  const Vector3d low = gravity_world_mps2(frame, Vector3d::Zero());
  EXPECT_NEAR(low.head<2>().norm(), 0.0, 1e-12);
  const Vector3d high = gravity_world_mps2(frame, {0.0, 0.0, 1000.0});
  // The free-air gradient, 3.086e-6 a second squared, is that of latitude 45 degrees.
  EXPECT_NEAR((low - high).z() / -1000.0, 3.086e-6, 0.002e-6);
  // A field without curl tilts with the height as it grows along the ground: Somigliana's formula, to the north, along
  // the meridian.
  const double e2 = kWgs84Flattening * (2.0 - kWgs84Flattening);
  const auto somigliana = [&](double lat) {
    const double s = std::sin(lat) * std::sin(lat);
    return 9.7803253359 * (1.0 + 0.00193185265241 * s) / std::sqrt(1.0 - e2 * s);
  };
  const double lat = 42.5 * std::numbers::pi / 180.0, small = 1e-4;
  const double radius_m =
      kWgs84SemiMajorAxis_m * (1.0 - e2) / std::pow(1.0 - e2 * std::sin(lat) * std::sin(lat), 1.5);
  const double growth =
      (somigliana(lat + small) - somigliana(lat - small)) / (2.0 * small * radius_m);
  EXPECT_NEAR(high.y(), -1000.0 * growth, 0.01 * 1000.0 * growth);
}

TEST(EarthRate, IsTheUpwardSineAndTheNorthwardCosineOfTheLatitude) {
  for (const double lat_deg : {-60.0, 0.0, 42.5}) {
    const Vector3d rate = earth_rate_world_radps(WorldFrame({lat_deg, -70.0, 2000.0}));
    const double lat = lat_deg * std::numbers::pi / 180.0;
    EXPECT_NEAR((rate - 7.292115e-5 * Vector3d(0.0, std::cos(lat), std::sin(lat))).norm(), 0.0,
                1e-19);
  }
}

}  // namespace
}  // namespace terracast::geo
