// First returns over a plane in closed form, and over hills against all their triangles.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/expect_error.h"
#include "tests/support/sensor_flight.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

constexpr double kDegree_rad = std::numbers::pi / 180.0;

/// A world of one level of a height function of x and y.
SensorFlight flight_over(double (*height_m)(double, double)) {
  return SensorFlight([height_m](const std::filesystem::path& folder) {
    return make_tiny_world(folder, height_m, {.finest_level = 3, .coarsest_level = 3});
  });
}

/// 120 m above z = 0 over the origin, looking down and by so much ahead.
std::shared_ptr<WavyMotion> looking_down(double ahead_deg) {
  auto motion = std::make_shared<WavyMotion>();
  motion->place[2].middle = 120.0;
  motion->pitch.middle = (90.0 - ahead_deg) * kDegree_rad;
  return motion;
}

double slope_m(double x, double) { return 20.0 + 0.25 * x; }

TEST(RadarAltimeter, OverAPlaneTheNearestPointInTheConeReturnsFirst) {
  const SensorFlight flight = flight_over(slope_m);
  const Vector3d normal = Vector3d(-0.25, 0.0, 1.0).normalized();
  const double foot_m = normal.dot(Vector3d(0.0, 0.0, 100.0));
  int num_beyond = 0;
  for (const double ahead_deg : {-50.0, -14.0362, -5.0, 0.0, 12.0, 40.0})
    for (const double half_angle_deg : {1.0, 10.0, 30.0, 60.0}) {
      const double range_m =
          flight.measure("radar_altimeter", "half_angle_deg = " + std::to_string(half_angle_deg),
                         looking_down(ahead_deg), 1.0, 1)[1];
      const double off_rad =
          std::acos(std::min(1.0, normal.dot(Vector3d(-std::sin(ahead_deg * kDegree_rad), 0.0,
                                                      std::cos(ahead_deg * kDegree_rad)))));
      const double beyond_rad = std::max(0.0, off_rad - half_angle_deg * kDegree_rad);
      num_beyond += beyond_rad > 0.0;
      EXPECT_NEAR(range_m, foot_m / std::cos(beyond_rad), 1e-9)
          << ahead_deg << " deg ahead, " << half_angle_deg << " deg";
    }
  EXPECT_GT(num_beyond, 8);
}

double ridges_m(double x, double y) {
  return 12.0 * std::sin(x * 0.03) * std::cos(y * 0.04) + 6.0 * std::sin(x * 0.11 + y * 0.07);
}

TEST(RadarAltimeter, OverHillsItFindsTheNearestOfAllTriangles) {
  const SensorFlight flight = flight_over(ridges_m);
  constexpr double kSpacing_m = 8.0, kHalf_rad = 35.0 * kDegree_rad;
  std::vector<double> heights_m;
  constexpr int kFirst = -25, kNodes = 64;
  for (int j = 0; j < kNodes; ++j)
    for (int i = 0; i < kNodes; ++i)
      heights_m.push_back(
          on_height_lattice(ridges_m(kSpacing_m * (i + kFirst), kSpacing_m * (j + kFirst))));
  const auto node = [&](int i, int j) {
    return heights_m[static_cast<std::size_t>((j - kFirst) * kNodes + i - kFirst)];
  };
  for (const double ahead_deg : {0.0, 20.0, -30.0}) {
    const auto motion = looking_down(ahead_deg);
    motion->place[0] = {.middle = -60.0, .slope = 11.3};
    motion->place[1] = {.middle = 15.0, .slope = 7.1};
    motion->place[2].middle = 70.0;
    const std::vector<double> values =
        flight.measure("radar_altimeter", "half_angle_deg = 35.0", motion, 1.0, 15);
    for (std::size_t k = 0; k < 15; ++k) {
      const geo::Rigid3d pose = motion->at(static_cast<double>(k)).world_from_body;
      const Vector3d axis = pose.rotation * Vector3d::UnitX();
      // Points of all triangles, 0.5 m apart: the nearest of them in the cone is farther than the nearest of all by less than
      // half a metre's slant.
      double nearest_m = std::numeric_limits<double>::infinity();
      for (double x = -200.0; x < 296.0; x += 0.5)
        for (double y = -200.0; y < 296.0; y += 0.5) {
          const int i = static_cast<int>(std::floor(x / kSpacing_m));
          const int j = static_cast<int>(std::floor(y / kSpacing_m));
          const double u = x / kSpacing_m - i, v = y / kSpacing_m - j;
          const double z = u + v <= 1.0 ? node(i, j) + u * (node(i + 1, j) - node(i, j)) +
                                              v * (node(i, j + 1) - node(i, j))
                                        : node(i + 1, j + 1) +
                                              (1 - u) * (node(i, j + 1) - node(i + 1, j + 1)) +
                                              (1 - v) * (node(i + 1, j) - node(i + 1, j + 1));
          const Vector3d off = Vector3d(x, y, z) - pose.translation;
          if (off.dot(axis) >= std::cos(kHalf_rad) * off.norm())
            nearest_m = std::min(nearest_m, off.norm());
        }
      EXPECT_LE(values[2 * k + 1], nearest_m + 1e-6) << ahead_deg << " deg, " << k;
      EXPECT_GE(values[2 * k + 1], nearest_m - 0.4) << ahead_deg << " deg, " << k;
    }
  }
}

TEST(RadarAltimeter, ErrorsGrowWithTheRange) {
  const SensorFlight flight = flight_over(slope_m);
  constexpr std::size_t kCount = 2000;
  for (const auto& [keys, sigma_m] :
       {std::pair{"noise_m = 2.0, noise_share = 0.001", 2.0},
        {"noise_m = 0.2, noise_share = 0.05", 0.05 * 100.0 / std::hypot(1.0, 0.25)}}) {
    std::string lines = keys;
    lines[lines.find(',')] = '\n';
    const std::vector<double> values =
        flight.measure("radar_altimeter", lines + "\nnum_rays = 1\nhalf_angle_deg = 40.0",
                       looking_down(0.0), 10.0, kCount);
    double squares = 0.0;
    for (std::size_t k = 0; k < kCount; ++k)
      squares += std::pow(values[2 * k] - values[2 * k + 1], 2);
    EXPECT_NEAR(squares / (kCount * sigma_m * sigma_m), 1.0, 4.0 * std::sqrt(2.0 / kCount));
  }
}

TEST(RadarAltimeter, WithoutErrorsItShowsTheTruthAndTheSky) {
  const SensorFlight flight = flight_over(slope_m);
  const auto up = looking_down(180.0);
  const std::vector<double> values = flight.measure("radar_altimeter", "", up, 1.0, 1);
  EXPECT_EQ(values[0], std::numeric_limits<double>::infinity());
  EXPECT_EQ(values[1], std::numeric_limits<double>::infinity());
  const std::vector<double> down = flight.measure("radar_altimeter", "", looking_down(0.0), 1.0, 1);
  EXPECT_EQ(down[0], down[1]);
  const std::vector<double> near =
      flight.measure("radar_altimeter", "most_range_m = 90.0", looking_down(0.0), 1.0, 1);
  EXPECT_EQ(near[0], std::numeric_limits<double>::infinity());
}

TEST(RadarAltimeter, RefusesWhatIsNoCone) {
  const auto refuse = [](const std::string& keys, const std::vector<std::string>& words) {
    expect_error(core::ErrorKind::Config, words, [&] { sensor_of("radar_altimeter", keys); });
  };
  refuse("half_angle_deg = 0.0", {"half_angle_deg"});
  refuse("half_angle_deg = 90.0", {"half_angle_deg", "80"});
  refuse("num_rays = 0", {"num_rays"});
  refuse("least_range_m = 10.0\nmost_range_m = 5.0", {"least_range_m = 10", "most_range_m = 5"});
}

}  // namespace
}  // namespace terracast::test
