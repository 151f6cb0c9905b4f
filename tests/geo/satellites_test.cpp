// Satellites' orbits against Newton's law, differences and the published constellation; signals against the equation of
// light time.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/random.h"
#include "geo/geodesy.h"
#include "geo/gps_time.h"
#include "geo/satellites/gps_constellation.h"
#include "geo/satellites/satellite_geometry.h"
#include "geo/satellites/signal_delays.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180.0;

/// As real ones are: an eccentric orbit with all terms.
BroadcastOrbit eccentric_orbit() {
  return {.prn = 7,
          .toe_gps_s = 1.4e9,
          .sqrt_a = 5153.7,
          .eccentricity = 0.012,
          .i0_rad = 0.96,
          .idot_radps = 3e-10,
          .omega0_rad = -1.2,
          .omega_rad = 0.8,
          .omega_dot_radps = -8e-9,
          .m0_rad = 2.5,
          .delta_n_radps = 4.5e-9,
          .cuc_rad = 2e-6,
          .cus_rad = 8e-6,
          .crc_m = 220.0,
          .crs_m = -40.0,
          .cic_rad = 1e-7,
          .cis_rad = -2e-7,
          .af0_s = 1e-4,
          .af1 = 3e-12,
          .af2_per_s = 1e-19};
}

/// Of a smooth function, by differences of four values: to the fourth order.
template <class Function>
auto derivative(const Function& function, double at, double step) {
  return (8.0 * (function(at + step) - function(at - step)) -
          (function(at + 2.0 * step) - function(at - 2.0 * step))) /
         (12.0 * step);
}

TEST(Satellites, VelocityAndClockRateAreDerivatives) {
  const BroadcastOrbit orbit = eccentric_orbit();
  for (double time_s = -7200.0; time_s <= 7200.0; time_s += 400.0) {
    const SatelliteState state = satellite_state(orbit, time_s);
    // Places of 2.6e7 m have steps of 4e-9 m; fifth derivatives of a circle of 12 h are 1e-13 of the velocity at 10 s.
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(state.velocity_ecef_mps[axis],
                  derivative([&](double t) { return satellite_state(orbit, t).place_ecef_m[axis]; },
                             time_s, 10.0),
                  1e-6);
    EXPECT_NEAR(
        state.clock_rate,
        derivative([&](double t) { return satellite_state(orbit, t).clock_s; }, time_s, 10.0),
        1e-18);
  }
}

TEST(Satellites, AnOrbitWithoutCorrectionsObeysNewton) {
  BroadcastOrbit orbit = eccentric_orbit();
  orbit.idot_radps = orbit.omega_dot_radps = orbit.delta_n_radps = 0.0;
  orbit.cuc_rad = orbit.cus_rad = orbit.crc_m = orbit.crs_m = orbit.cic_rad = orbit.cis_rad = 0.0;
  const auto inertial = [&](double t) -> Vector3d {
    return Eigen::AngleAxisd(kGpsEarthRate_radps * t, Vector3d::UnitZ()) *
           satellite_state(orbit, t).place_ecef_m;
  };
  for (double time_s = 0.0; time_s < 43200.0; time_s += 3000.0) {
    constexpr double kStep_s = 60.0;
    const Vector3d place = inertial(time_s);
    const Vector3d acceleration =
        (inertial(time_s + kStep_s) - 2.0 * place + inertial(time_s - kStep_s)) /
        (kStep_s * kStep_s);
    const Vector3d law = -kGpsGravity_m3ps2 / std::pow(place.norm(), 3) * place;
    // Second differences of a circle of rate n err by (n step)^2 / 12 = 6e-6; the eccentric one by a little more.
    EXPECT_LT((acceleration - law).norm(), 1e-5 * law.norm());
  }
}

TEST(Satellites, SignalsTakeTheTimeOfLight) {
  const BroadcastOrbit orbit = eccentric_orbit();
  const Vector3d velocity(30.0, -50.0, 12.0);
  const Vector3d start = ecef_from_geodetic({42.5, 1.5, 2300.0});
  const auto range_at = [&](double t) {
    return received(orbit, t, start + t * velocity, velocity).range_m;
  };
  for (double time_s = -5000.0; time_s < 5000.0; time_s += 250.0) {
    const Vector3d place = start + time_s * velocity;
    const ReceivedSatellite signal = received(orbit, time_s, place, velocity);
    // In axes that do not turn: those of the Earth at reception.
    const double light_s = signal.range_m / kLight_mps;
    const Vector3d sent = Eigen::AngleAxisd(-kGpsEarthRate_radps * light_s, Vector3d::UnitZ()) *
                          satellite_state(orbit, time_s - light_s).place_ecef_m;
    EXPECT_NEAR((sent - place).norm(), signal.range_m, 1e-6);
    EXPECT_LT((signal.place_ecef_m - sent).norm(), 1e-6);
    EXPECT_NEAR(signal.range_rate_mps, derivative(range_at, time_s, 5.0), 1e-6);
    // Without the Earth's turn it would be up to 30 m off.
    EXPECT_LT(std::abs((satellite_state(orbit, time_s - light_s).place_ecef_m - place).norm() -
                       signal.range_m),
              45.0);
  }
}

TEST(Satellites, TheBaselineStandsInItsSlots) {
  constexpr double kEpoch_unix_s = 741484800.0;  // 1993-07-01
  const double epoch_gps_s = gps_seconds_from_unix(kEpoch_unix_s);
  // The epoch in GPS time is 9 leap seconds late of an even hour.
  const double toe_s = toe_of(epoch_gps_s);
  EXPECT_NEAR(toe_s, epoch_gps_s, 3600.0);
  const std::vector<BroadcastOrbit> orbits = baseline_constellation(toe_s);
  ASSERT_EQ(orbits.size(), 24U);
  struct Slot {
    int prn;
    double node_deg, latitude_deg;
  };
  // A1, B3, D3 and F4 of the table.
  for (const Slot slot : {Slot{1, 272.847, 268.126}, Slot{7, 332.847, 309.976},
                          Slot{15, 92.847, 35.156}, Slot{24, 212.847, 135.346}}) {
    const BroadcastOrbit& orbit = orbits[static_cast<std::size_t>(slot.prn - 1)];
    EXPECT_EQ(orbit.prn, slot.prn);
    const Vector3d place = satellite_state(orbit, epoch_gps_s - toe_s).place_ecef_m;
    EXPECT_NEAR(place.norm(), 26559700.0, 1e-3);
    const double node = (slot.node_deg - 279.06) * kDegree, u = slot.latitude_deg * kDegree;
    const double tilt = 55.0 * kDegree;
    const Vector3d along(std::cos(node), std::sin(node), 0.0);
    const Vector3d across(-std::cos(tilt) * std::sin(node), std::cos(tilt) * std::cos(node),
                          std::sin(tilt));
    const Vector3d right = 26559700.0 * (std::cos(u) * along + std::sin(u) * across);
    EXPECT_LT((place - right).norm(), 0.01) << slot.prn;
  }
}

TEST(Satellites, TracksRepeatAndElementsOfNeighbouringHoursAgree) {
  const double toe_s = toe_of(1.43e9);
  const std::vector<BroadcastOrbit> now = baseline_constellation(toe_s);
  const std::vector<BroadcastOrbit> later = baseline_constellation(toe_s + kOrbitInterval_s);
  const double day_s = 2.0 * kPi / (kGpsEarthRate_radps + 4.4874e-7 * kDegree);
  for (std::size_t i = 0; i < now.size(); ++i) {
    const Vector3d between = satellite_state(now[i], 0.5 * kOrbitInterval_s).place_ecef_m;
    // Elements have 13 digits: 3e-5 m each.
    EXPECT_LT((between - satellite_state(later[i], -0.5 * kOrbitInterval_s).place_ecef_m).norm(),
              1e-3);
    EXPECT_LT(
        (satellite_state(now[i], day_s).place_ecef_m - satellite_state(now[i], 0.0).place_ecef_m)
            .norm(),
        0.01);
  }
}

TEST(Satellites, EveryPlaceSeesEnough) {
  std::uint64_t drawn = 0;
  const auto between = [&](double lowest, double highest) {
    return core::random_between(lowest, highest, 3141, 0, drawn++);
  };
  int open = 0, wide = 0;
  constexpr int kPlaces = 2000;
  for (int k = 0; k < kPlaces; ++k) {
    const Geodetic place{std::asin(between(-1.0, 1.0)) / kDegree, between(-180.0, 180.0), 0.0};
    const double gps_s = between(1e9, 2e9);
    const double toe_s = toe_of(gps_s);
    const Eigen::Matrix3d ecef_from_enu =
        WorldFrame(place).ecef_from_world().rotation.toRotationMatrix();
    std::vector<Vector3d> seen;
    for (const BroadcastOrbit& orbit : baseline_constellation(toe_s)) {
      const ReceivedSatellite signal =
          received(orbit, gps_s - toe_s, ecef_from_geodetic(place), Vector3d::Zero());
      const Vector3d enu = ecef_from_enu.transpose() * signal.direction_ecef;
      if (enu.z() > std::sin(5.0 * kDegree)) seen.push_back(enu);
    }
    if (seen.size() < 4) ++open;
    if (!(dilution_of_precision(seen).position <= 6.0)) ++wide;
  }
  // The performance standard of 2008, section 3.2: PDOP of 6 and less 98 % of the time at the least, in all places.
  EXPECT_EQ(open, 0);
  EXPECT_LE(wide, kPlaces / 50);
}

TEST(Satellites, DilutionOfKnownSkies) {
  std::vector<Vector3d> sky{{0.0, 0.0, 1.0}};
  for (int k = 0; k < 3; ++k)
    sky.emplace_back(std::cos(k * 2.0 * kPi / 3.0), std::sin(k * 2.0 * kPi / 3.0), 0.0);
  // Three around find the clock to 1/3 and each axis to 2/3; the one overhead has both errors.
  const DilutionOfPrecision dilution = dilution_of_precision(sky);
  EXPECT_NEAR(dilution.horizontal, std::sqrt(4.0 / 3.0), 1e-14);
  EXPECT_NEAR(dilution.vertical, std::sqrt(4.0 / 3.0), 1e-14);
  EXPECT_NEAR(dilution.position, std::sqrt(8.0 / 3.0), 1e-14);
  EXPECT_NEAR(dilution.time, std::sqrt(1.0 / 3.0), 1e-14);
  // On a cone about the zenith height and clock cannot be separated; three leave a fix open.
  std::vector<Vector3d> cone;
  for (int k = 0; k < 8; ++k)
    cone.emplace_back(0.6 * std::cos(0.25 * k * kPi), 0.6 * std::sin(0.25 * k * kPi), 0.8);
  EXPECT_EQ(dilution_of_precision(cone).position, std::numeric_limits<double>::infinity());
  sky.pop_back();
  EXPECT_EQ(dilution_of_precision(sky).time, std::numeric_limits<double>::infinity());
}

TEST(Satellites, AirDelaysSignals) {
  // Saastamoinen's hydrostatic delay at the zenith of a standard pressure is 2.307 m at 45 degrees; wet parts of 10 to 25 cm.
  const double zenith_m = troposphere_delay_m(45.0 * kDegree, 0.0, 0.5 * kPi);
  EXPECT_GT(zenith_m, 2.307 + 0.05);
  EXPECT_LT(zenith_m, 2.307 + 0.25);
  EXPECT_NEAR(troposphere_delay_m(45.0 * kDegree, 0.0, 30.0 * kDegree), 2.0 * zenith_m, 1e-12);
  // At 5500 m half the pressure is left, and little vapour.
  EXPECT_NEAR(troposphere_delay_m(45.0 * kDegree, 5500.0, 0.5 * kPi), 0.5 * 2.307, 0.04);
  // At night the model is 5 ns along the zenith, whatever its numbers.
  const KlobucharModel model = klobuchar_of_2004();
  EXPECT_NEAR(ionosphere_delay_m(model, {0.0, 0.0, 0.0}, 0.0, 0.5 * kPi, 3600.0),
              kLight_mps * 5e-9 * (1.0 + 16.0 * std::pow(0.03, 3)), 1e-9);
}

}  // namespace
}  // namespace terracast::geo
