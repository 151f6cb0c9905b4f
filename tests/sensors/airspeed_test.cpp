// Pressures of a pitot tube against the closed forms of gas dynamics, and their errors against their theory.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/support/expect_error.h"
#include "tests/support/sensor_flight.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

/// A motion in a wind that changes.
struct WindyMotion : WavyMotion {
  Vector3d wind_world_mps(double t) const override {
    return {3.0 + std::sin(t), -2.0, 0.5 * std::cos(2.0 * t)};
  }
};

struct AirspeedSample {
  double shown_pa, indicated_mps, true_pa, airspeed_mps;
  Vector3d wind_enu_mps;
};

class Pitot : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/usr/share/proj/egm96_15.gtx"))
      GTEST_SKIP() << "no grid of EGM96: install proj-data";
  }
  std::vector<AirspeedSample> measure(const std::string& keys,
                                      std::shared_ptr<const geo::Trajectory> motion, double rate_hz,
                                      std::size_t count, const geo::Rigid3d& mount = {},
                                      std::uint64_t seed = 11) const {
    const std::vector<double> v =
        flight_.measure("airspeed", keys, std::move(motion), rate_hz, count, mount, seed);
    EXPECT_EQ(v.size(), 7 * count);
    std::vector<AirspeedSample> samples;
    for (std::size_t k = 0; k < v.size(); k += 7)
      samples.push_back({v[k], v[k + 1], v[k + 2], v[k + 3], {v[k + 4], v[k + 5], v[k + 6]}});
    return samples;
  }
  const geo::WorldFrame& frame() const { return flight_.frame(); }

 private:
  SensorFlight flight_;
};

/// Straight east at a speed, level, its nose ahead, at a height of the world.
std::shared_ptr<WavyMotion> eastward(double speed_mps, double height_m) {
  auto motion = std::make_shared<WavyMotion>();
  motion->place[0].slope = speed_mps;
  motion->place[2].middle = height_m;
  return motion;
}

double altitude_msl_m(const geo::WorldFrame& frame, const Vector3d& place_world) {
  const geo::Geodetic place = frame.geodetic_from_world(place_world);
  return place.height_m - geo::Geoid::egm96()->undulation_m(place.lat_deg, place.lon_deg);
}

/// ISO 2533 below 11 km, in its own formulas.
struct StandardAir {
  double pressure_pa, temperature_k, density_kg_per_m3;
  explicit StandardAir(double altitude_m) {
    const double h = 6356766.0 * altitude_m / (6356766.0 + altitude_m);
    temperature_k = 288.15 - 0.0065 * h;
    pressure_pa = 101325.0 * std::pow(temperature_k / 288.15, 9.80665 / (287.05287 * 0.0065));
    density_kg_per_m3 = pressure_pa / (287.05287 * temperature_k);
  }
};

// Impact pressure of an ideal gas: p ((1 + 0.2 M^2)^3.5 - 1), which at low speeds is rho V^2 / 2.
TEST_F(Pitot, ShowsTheImpactPressureOfItsSpeedThroughTheAir) {
  auto motion = std::make_shared<WindyMotion>();
  static_cast<WavyMotion&>(*motion) = *figure_of_eight();
  const geo::Rigid3d mount{
      .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Vector3d::UnitZ())),
      .translation = {0.4, 1.5, 0.1}};
  const auto samples = measure("", motion, 5.0, 100, mount);
  int num_forward = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double t = static_cast<double>(k) / 5.0;
    const geo::MotionState body = motion->at(t);
    const Eigen::Matrix3d axes = body.world_from_body.rotation.toRotationMatrix();
    const Vector3d place = body.world_from_body * mount.translation;
    const Vector3d velocity =
        body.velocity_world_mps + axes * body.angular_velocity_body_radps.cross(mount.translation);
    const Vector3d through_air = velocity - motion->wind_world_mps(t);
    const double along = (axes * mount.rotation.toRotationMatrix()).col(0).dot(through_air);
    const StandardAir air(altitude_msl_m(frame(), place));
    const double mach2 = along * along / (1.4 * 287.05287 * air.temperature_k);
    const double expected =
        along > 0.0 ? air.pressure_pa * (std::pow(1.0 + 0.2 * mach2, 3.5) - 1.0) : 0.0;
    num_forward += along > 0.0 ? 1 : 0;
    EXPECT_NEAR(samples[k].true_pa, expected, 1e-9 * air.pressure_pa);
    EXPECT_EQ(samples[k].shown_pa, samples[k].true_pa);
    EXPECT_NEAR(samples[k].airspeed_mps, through_air.norm(), 1e-9);
    EXPECT_NEAR(samples[k].indicated_mps, std::sqrt(2.0 * expected / 1.225), 1e-6);
    EXPECT_LT((frame().world_from_enu(place) * samples[k].wind_enu_mps - motion->wind_world_mps(t))
                  .norm(),
              1e-12);
  }
  EXPECT_GT(num_forward, 20);
}

// At 25 m/s compression adds M^2 / 4 of the pressure: 0.13 %.
TEST_F(Pitot, AtLowSpeedsItIsHalfRhoVSquared) {
  for (const double speed_mps : {10.0, 25.0, 40.0}) {
    const auto motion = eastward(speed_mps, 900.0);
    const AirspeedSample sample = measure("", motion, 1.0, 1)[0];
    const StandardAir air(altitude_msl_m(frame(), {0.0, 0.0, 900.0}));
    const double mach2 = speed_mps * speed_mps / (1.4 * 287.05287 * air.temperature_k);
    const double simple = 0.5 * air.density_kg_per_m3 * speed_mps * speed_mps;
    EXPECT_NEAR(sample.true_pa / simple, 1.0 + mach2 / 4.0, mach2 * mach2 / 20.0);
    // Thinner air is shown slower: sqrt(rho / rho_0).
    EXPECT_NEAR(sample.indicated_mps / (speed_mps * std::sqrt(air.density_kg_per_m3 / 1.225)),
                1.0 + mach2 / 8.0, mach2 * mach2 / 20.0);
  }
}

TEST_F(Pitot, HeadwindsCountAndAirFromBehindDoesNot) {
  struct Blown : WavyMotion {
    double wind_mps = 0.0;
    Vector3d wind_world_mps(double) const override { return {wind_mps, 0.0, 0.0}; }
  };
  auto motion = std::make_shared<Blown>();
  static_cast<WavyMotion&>(*motion) = *eastward(10.0, 900.0);
  motion->wind_mps = -15.0;
  const double headwind_pa = measure("", motion, 1.0, 1)[0].true_pa;
  EXPECT_NEAR(headwind_pa, measure("", eastward(25.0, 900.0), 1.0, 1)[0].true_pa, 1e-9);
  motion->wind_mps = 12.0;
  const AirspeedSample tailwind = measure("", motion, 1.0, 1)[0];
  EXPECT_EQ(tailwind.true_pa, 0.0);
  EXPECT_EQ(tailwind.indicated_mps, 0.0);
  EXPECT_NEAR(tailwind.airspeed_mps, 2.0, 1e-12);
}

TEST_F(Pitot, ErrorsHaveTheSizesOfTheirParameters) {
  constexpr std::size_t kCount = 20000;
  double squares = 0.0;
  for (const AirspeedSample& sample :
       measure("errors = { noise_pa = 2.5 }", eastward(0.0, 900.0), 10.0, kCount))
    squares += std::pow(sample.shown_pa - sample.true_pa, 2);
  EXPECT_NEAR(squares / (kCount * 6.25), 1.0, 4.0 * std::sqrt(2.0 / kCount));
  double offsets = 0.0;
  for (std::uint64_t seed = 0; seed < 400; ++seed)
    offsets += std::pow(
        measure("errors = { turn_on_pa = 30.0 }", eastward(20.0, 900.0), 1.0, 1, {}, seed)[0]
                .shown_pa -
            measure("", eastward(20.0, 900.0), 1.0, 1)[0].true_pa,
        2);
  EXPECT_NEAR(offsets / (400.0 * 900.0), 1.0, 4.0 * std::sqrt(2.0 / 400.0));
  // The range, and a speed from what is shown.
  const AirspeedSample fast =
      measure("range_pa = 300.0\nerrors = { step_pa = 0.5 }", eastward(60.0, 900.0), 1.0, 1)[0];
  EXPECT_GT(fast.true_pa, 1000.0);
  EXPECT_EQ(fast.shown_pa, 300.0);
  EXPECT_NEAR(fast.indicated_mps, std::sqrt(600.0 / 1.225), 1e-9);
}

TEST_F(Pitot, RefusesWhatIsNoPressure) {
  const auto refuse = [](const std::string& keys, const std::vector<std::string>& words) {
    expect_error(core::ErrorKind::Config, words, [&] { sensor_of("airspeed", keys); });
  };
  refuse("sea_level_pressure_pa = 1013.25", {"sea_level_pressure_pa", "1013.25", "80000"});
  refuse("range_pa = -1.0", {"range_pa", "-1"});
  refuse("errors = { noise_pa = -1.0 }", {"noise_pa", "-1"});
}

TEST_F(Pitot, ShippedSetsAreRead) {
  const auto samples =
      measure("errors = \"" TERRACAST_SOURCE_DIR "/configs/sensors/px4_gazebo/airspeed.toml\"",
              eastward(20.0, 900.0), 10.0, 2);
  EXPECT_NE(samples[0].shown_pa, samples[0].true_pa);
}

}  // namespace
}  // namespace terracast::test
