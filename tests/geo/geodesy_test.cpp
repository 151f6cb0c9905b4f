#include "geo/geodesy.h"

#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

constexpr std::uint64_t kSeed = 1;

double random_between(double lowest, double highest, std::uint64_t stream, std::uint64_t index) {
  return core::random_between(lowest, highest, kSeed, stream, index);
}

/// The textbook formula, with 64 bits of mantissa.
Eigen::Vector3d ecef_by_formula(const Geodetic& p) {
  constexpr long double kPi = std::numbers::pi_v<long double>;
  const long double a = 6378137.0L;
  const long double f = 1.0L / 298.257223563L;
  const long double e2 = f * (2.0L - f);
  const long double lat = static_cast<long double>(p.lat_deg) * kPi / 180.0L;
  const long double lon = static_cast<long double>(p.lon_deg) * kPi / 180.0L;
  const long double n = a / std::sqrt(1.0L - e2 * std::sin(lat) * std::sin(lat));
  const long double h = p.height_m;
  return {static_cast<double>((n + h) * std::cos(lat) * std::cos(lon)),
          static_cast<double>((n + h) * std::cos(lat) * std::sin(lon)),
          static_cast<double>((n * (1.0L - e2) + h) * std::sin(lat))};
}

TEST(Geodesy, MatchesPublishedPoints) {
  // The example of GeographicLib's CartConvert page, printed to 0.01 m.
  const Eigen::Vector3d published(3816209.60, 3737108.55, 3485109.57);
  EXPECT_LT((ecef_from_geodetic({33.3, 44.4, 6000.0}) - published).cwiseAbs().maxCoeff(), 0.005);
  // Its tangent frame at (33, 44, 20); the page cuts digits off here where it rounds them above.
  const Eigen::Vector3d published_world(37288.97, 33374.29, 5783.64);
  const WorldFrame frame({33.0, 44.0, 20.0});
  EXPECT_LT(
      (frame.world_from_geodetic({33.3, 44.4, 6000.0}) - published_world).cwiseAbs().maxCoeff(),
      0.01);
  // The axes of WGS84 by definition: a = 6378137 m, b = 6356752.3142 m.
  EXPECT_DOUBLE_EQ(ecef_from_geodetic({0.0, 0.0, 0.0}).x(), 6378137.0);
  EXPECT_NEAR(ecef_from_geodetic({90.0, 0.0, 0.0}).z(), 6356752.3142, 0.00005);
  EXPECT_NEAR(ecef_from_geodetic({-90.0, 0.0, 100.0}).z(), -6356852.3142, 0.00005);
}

TEST(Geodesy, MatchesTheFormulaAndItselfWithinTenNanometres) {
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const Geodetic point{random_between(-90, 90, 1, i), random_between(-180, 180, 2, i),
                         random_between(-11000, 20000, 3, i)};
    const Eigen::Vector3d ecef = ecef_from_geodetic(point);
    ASSERT_LT((ecef - ecef_by_formula(point)).norm(), 1e-8)
        << point.lat_deg << " " << point.lon_deg;
    const Geodetic back = geodetic_from_ecef(ecef);
    ASSERT_LT((ecef_by_formula(back) - ecef).norm(), 1e-8) << point.lat_deg << " " << point.lon_deg;
    ASSERT_NEAR(back.height_m, point.height_m, 1e-8);
  }
}

TEST(WorldFrame, AgreesWithLocalCartesian) {
  for (std::uint64_t i = 0; i < 50; ++i) {
    const Geodetic origin{random_between(-89.9, 89.9, 4, i), random_between(-180, 180, 5, i),
                          random_between(-100, 4000, 6, i)};
    const WorldFrame frame(origin);
    const GeographicLib::LocalCartesian local(origin.lat_deg, origin.lon_deg, origin.height_m);
    for (std::uint64_t j = 0; j < 50; ++j) {
      const Eigen::Vector3d world(random_between(-60000, 60000, 7, i * 50 + j),
                                  random_between(-60000, 60000, 8, i * 50 + j),
                                  random_between(-500, 9000, 9, i * 50 + j));
      Geodetic expected;
      local.Reverse(world.x(), world.y(), world.z(), expected.lat_deg, expected.lon_deg,
                    expected.height_m);
      const Geodetic place = frame.geodetic_from_world(world);
      // Adding 6 400 km and taking it off again rounds at 1 nm; ten of them are allowed.
      ASSERT_NEAR(place.height_m, expected.height_m, 1e-8);
      ASSERT_NEAR(place.lat_deg, expected.lat_deg, 1e-13);
      ASSERT_NEAR(place.lon_deg, expected.lon_deg, 1e-13 / std::cos(radians_from_degrees(89.95)));
      ASSERT_LT((frame.world_from_geodetic(place) - world).norm(), 1e-8);
    }
  }
}

TEST(WorldFrame, AxesPointEastNorthAndUpAtTheOrigin) {
  const WorldFrame frame({42.5, 1.55, 1200.0});
  EXPECT_LT(frame.world_from_geodetic(frame.origin()).norm(), 1e-8);
  EXPECT_LT((frame.world_from_enu(Eigen::Vector3d::Zero()) - Eigen::Matrix3d::Identity()).norm(),
            1e-14);
  EXPECT_GT(frame.world_from_geodetic({42.5, 1.56, 1200.0}).x(), 800.0);
  EXPECT_GT(frame.world_from_geodetic({42.51, 1.55, 1200.0}).y(), 1000.0);
  EXPECT_NEAR(frame.world_from_geodetic({42.5, 1.55, 1300.0}).z(), 100.0, 1e-8);
}

TEST(WorldFrame, TheEarthCurvesAwayBelowIt) {
  const WorldFrame frame({42.5, 1.55, 0.0});
  // 35.36 km from the origin on a sphere of 6 371 km: 98.1 m, to the ellipsoid's half percent.
  EXPECT_NEAR(frame.geodetic_from_world({25000.0, 25000.0, 0.0}).height_m, 98.1, 0.5);
  const Eigen::Vector3d up = frame.up_world({25000.0, 0.0, 0.0});
  EXPECT_NEAR(degrees_from_radians(std::acos(up.z())), 25.0 / 6388.0 * 57.29578, 1e-4);
  EXPECT_GT(up.x(), 0.0);
}

TEST(WorldFrame, UpIsTheGradientOfHeight) {
  const WorldFrame frame({-33.0, 151.0, 50.0});
  for (std::uint64_t i = 0; i < 100; ++i) {
    const Eigen::Vector3d point(random_between(-30000, 30000, 10, i),
                                random_between(-30000, 30000, 11, i),
                                random_between(0, 5000, 12, i));
    Eigen::Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = 10.0 * Eigen::Vector3d::Unit(axis);
      gradient[axis] = (frame.geodetic_from_world(point + step).height_m -
                        frame.geodetic_from_world(point - step).height_m) /
                       20.0;
    }
    // Heights round at 1 nm, so the differences are good to about 1e-10.
    ASSERT_LT((gradient - frame.up_world(point)).norm(), 1e-9);
    const Eigen::Matrix3d enu = frame.world_from_enu(point);
    ASSERT_LT((enu.transpose() * enu - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    ASSERT_NEAR(enu.determinant(), 1.0, 1e-14);
    // East keeps latitude and height: to second order in the 10 m step.
    const Geodetic place = frame.geodetic_from_world(point);
    const Geodetic east = frame.geodetic_from_world(point + 10.0 * enu.col(0));
    ASSERT_NEAR(east.lat_deg, place.lat_deg, 1e-9);
    ASSERT_GT(east.lon_deg, place.lon_deg);
  }
}

TEST(Geodesy, RefusesWhatIsNoPlace) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Geodetic& bad : {Geodetic{91.0, 0.0, 0.0}, Geodetic{-90.001, 0.0, 0.0},
                              Geodetic{nan, 0.0, 0.0}, Geodetic{0.0, nan, 0.0}, Geodetic{0, 0, nan},
                              Geodetic{0, std::numeric_limits<double>::infinity(), 0}}) {
    for (const auto& call : std::vector<std::function<void()>>{[&] { ecef_from_geodetic(bad); },
                                                               [&] { WorldFrame frame(bad); }}) {
      try {
        call();
        ADD_FAILURE() << "no error for " << bad.lat_deg << " " << bad.lon_deg;
      } catch (const core::Error& error) {
        EXPECT_EQ(error.kind(), core::ErrorKind::Input);
      }
    }
  }
  EXPECT_THROW(geodetic_from_ecef({nan, 0.0, 0.0}), core::Error);
  const WorldFrame frame({0.0, 0.0, 0.0});
  EXPECT_THROW(frame.geodetic_from_world({0.0, nan, 0.0}), core::Error);
}

TEST(WorldFrame, ManyThreadsGetTheSameBits) {
  const WorldFrame frame({42.5, 1.55, 1200.0});
  const auto all = [&] {
    std::vector<Geodetic> places;
    for (std::uint64_t i = 0; i < 2000; ++i)
      places.push_back(frame.geodetic_from_world(
          {random_between(-3e4, 3e4, 13, i), random_between(-3e4, 3e4, 14, i), 100.0}));
    return places;
  };
  const std::vector<Geodetic> alone = all();
  std::vector<std::vector<Geodetic>> together(4);
  {
    std::vector<std::jthread> threads;
    for (auto& result : together) threads.emplace_back([&] { result = all(); });
  }
  for (const auto& result : together) EXPECT_EQ(result, alone);
}

TEST(HorizonDistance, BoundsEveryVisiblePointAndIsTight) {
  EXPECT_NEAR(horizon_distance_m(1000.0), 113137.9, 0.1);  // sqrt(1000 (2 x 6399593.6 + 1000))
  EXPECT_EQ(horizon_distance_m(0.0), 0.0);
  EXPECT_EQ(horizon_distance_m(-5.0), 0.0);
  // Tangent points of the ellipsoid, in the space where it is the unit sphere.
  const Eigen::Vector3d axes(kWgs84SemiMajorAxis_m, kWgs84SemiMajorAxis_m,
                             kWgs84SemiMajorAxis_m * (1.0 - kWgs84Flattening));
  double closest = 0.0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const double height_m = random_between(1.0, 12000.0, 15, i);
    const Eigen::Vector3d eye =
        ecef_from_geodetic({i % 10 == 0 ? 90.0 : random_between(-90, 90, 16, i), 0.0, height_m});
    const Eigen::Vector3d scaled = eye.cwiseQuotient(axes);
    const Eigen::Vector3d axis = scaled.normalized();
    const double angle = random_between(0.0, 6.28, 17, i);
    const Eigen::Vector3d side = std::cos(angle) * axis.unitOrthogonal() +
                                 std::sin(angle) * axis.cross(axis.unitOrthogonal());
    const double along = 1.0 / scaled.norm();
    const Eigen::Vector3d tangent =
        (along * axis + std::sqrt(1.0 - along * along) * side).cwiseProduct(axes);
    const double distance_m = (tangent - eye).norm();
    ASSERT_LE(distance_m, horizon_distance_m(height_m) * (1.0 + 1e-9));
    closest = std::max(closest, distance_m / horizon_distance_m(height_m));
  }
  EXPECT_GT(closest, 0.999);  // at the poles both radii are the largest
}

}  // namespace
}  // namespace terracast::geo
