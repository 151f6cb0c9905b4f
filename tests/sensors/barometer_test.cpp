// Pressures against the standard atmosphere's formula, and their errors against their theory.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/support/expect_error.h"
#include "tests/support/sensor_flight.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

struct Pressure {
  double shown_pa, true_pa, altitude_msl_m;
};

class Barometer : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/usr/share/proj/egm96_15.gtx"))
      GTEST_SKIP() << "no grid of EGM96: install proj-data";
  }
  std::vector<Pressure> measure(const std::string& keys,
                                std::shared_ptr<const geo::Trajectory> motion, double rate_hz,
                                std::size_t count, const geo::Rigid3d& body_from_sensor = {},
                                std::uint64_t seed = 11) const {
    const std::vector<double> values = flight_.measure("barometer", keys, std::move(motion),
                                                       rate_hz, count, body_from_sensor, seed);
    EXPECT_EQ(values.size(), 3 * count);
    std::vector<Pressure> pressures;
    for (std::size_t k = 0; k < count; ++k)
      pressures.push_back({values[3 * k], values[3 * k + 1], values[3 * k + 2]});
    return pressures;
  }
  const geo::WorldFrame& frame() const { return flight_.frame(); }

 private:
  SensorFlight flight_;
};

TEST_F(Barometer, ShowsThePressureOfItsHeightAboveMeanSeaLevel) {
  const auto motion = figure_of_eight();
  const geo::Rigid3d mount{.rotation = Eigen::Quaterniond::Identity(),
                           .translation = {0.0, 2.0, 1.5}};
  const std::vector<Pressure> pressures = measure("", motion, 5.0, 100, mount);
  double by_lever_arm_pa = 0.0;
  for (std::size_t k = 0; k < pressures.size(); ++k) {
    const geo::MotionState body = motion->at(static_cast<double>(k) / 5.0);
    const auto altitude_of = [&](const Vector3d& arm) {
      const geo::Geodetic place = frame().geodetic_from_world(body.world_from_body * arm);
      return place.height_m - geo::Geoid::egm96()->undulation_m(place.lat_deg, place.lon_deg);
    };
    // ISO 2533 to 11 km, in its one formula.
    const auto pressure_of = [](double altitude_m) {
      const double h = 6356766.0 * altitude_m / (6356766.0 + altitude_m);
      return 101325.0 * std::pow(1.0 - 0.0065 * h / 288.15, 9.80665 / (287.05287 * 0.0065));
    };
    EXPECT_NEAR(pressures[k].altitude_msl_m, altitude_of(mount.translation), 1e-8);
    EXPECT_NEAR(pressures[k].true_pa, pressure_of(altitude_of(mount.translation)), 1e-6);
    EXPECT_EQ(pressures[k].shown_pa, pressures[k].true_pa);
    by_lever_arm_pa =
        std::max(by_lever_arm_pa,
                 std::abs(pressures[k].true_pa - pressure_of(altitude_of(Vector3d::Zero()))));
  }
  // 2.5 m of height are 29 Pa here.
  EXPECT_GT(by_lever_arm_pa, 20.0);
}

TEST_F(Barometer, ADaysAirIsAnotherOne) {
  const auto motion = std::make_shared<WavyMotion>();
  motion->place[2].middle = 500.0;
  const Pressure standard = measure("", motion, 1.0, 1)[0];
  const Pressure low = measure("sea_level_pressure_pa = 98000.0", motion, 1.0, 1)[0];
  EXPECT_NEAR(low.true_pa / standard.true_pa, 98000.0 / 101325.0, 1e-12);
  const Pressure warm = measure("warmer_k = 20.0", motion, 1.0, 1)[0];
  const double h = 6356766.0 * warm.altitude_msl_m / (6356766.0 + warm.altitude_msl_m);
  EXPECT_NEAR(warm.true_pa, 101325.0 * std::pow(1.0 - 0.0065 * h / 308.15, 5.2558797), 1e-3);
}

TEST_F(Barometer, ErrorsHaveTheSizesOfTheirParameters) {
  constexpr std::size_t kCount = 40000;
  const auto errors_of = [&](const std::string& keys, std::uint64_t seed = 11) {
    std::vector<double> errors;
    for (const Pressure& pressure : measure("errors = { " + keys + " }",
                                            std::make_shared<WavyMotion>(), 10.0, kCount, {}, seed))
      errors.push_back(pressure.shown_pa - pressure.true_pa);
    return errors;
  };
  const auto variance_of = [](const std::vector<double>& errors, std::size_t lag) {
    double squares = 0.0;
    for (std::size_t k = lag; k < errors.size(); ++k)
      squares += std::pow(lag == 0 ? errors[k] : errors[k] - errors[k - lag], 2);
    return squares / static_cast<double>(errors.size() - lag);
  };
  EXPECT_NEAR(variance_of(errors_of("noise_pa = 2.5"), 0) / 6.25, 1.0,
              4.0 * std::sqrt(2.0 / kCount));
  // A walk gains walk^2 t.
  const std::vector<double> walk = errors_of("walk_pa_per_sqrt_s = 0.4");
  EXPECT_NEAR(variance_of(walk, 1) / (0.16 * 0.1), 1.0, 4.0 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(variance_of(walk, 100) / (0.16 * 10.0), 1.0,
              4.0 * std::sqrt(4.0 / 3.0 * 100.0 / kCount));
  // A Gauss-Markov drift over 5 s: between two times it differs by 2 s^2 (1 - exp(-t / 5 s)).
  const std::vector<double> markov = errors_of("markov_pa = 30.0, markov_s = 5.0");
  EXPECT_NEAR(variance_of(markov, 0) / 900.0, 1.0, 4.0 * std::sqrt(2.0 * 50.0 / kCount));
  EXPECT_NEAR(variance_of(markov, 10) / (1800.0 * -std::expm1(-0.2)), 1.0,
              4.0 * std::sqrt(2.0 * 20.0 / kCount));
  double squares = 0.0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    const auto shown = measure("errors = { turn_on_pa = 50.0 }", std::make_shared<WavyMotion>(),
                               10.0, 2, {}, seed);
    EXPECT_NEAR(shown[0].shown_pa - shown[0].true_pa, shown[1].shown_pa - shown[1].true_pa, 1e-9);
    squares += std::pow(shown[0].shown_pa - shown[0].true_pa, 2);
  }
  EXPECT_NEAR(squares / (400.0 * 2500.0), 1.0, 4.0 * std::sqrt(2.0 / 400.0));
  for (const Pressure& pressure :
       measure("errors = { step_pa = 0.25 }", figure_of_eight(), 10.0, 50)) {
    EXPECT_NEAR(pressure.shown_pa, pressure.true_pa, 0.125 + 1e-9);
    EXPECT_EQ(pressure.shown_pa / 0.25, std::round(pressure.shown_pa / 0.25));
  }
}

TEST_F(Barometer, RefusesWhatIsNoPressure) {
  const auto refuse = [](const std::string& keys, const std::vector<std::string>& words) {
    expect_error(core::ErrorKind::Config, words, [&] { sensor_of("barometer", keys); });
  };
  refuse("sea_level_pressure_pa = 1013.25", {"sea_level_pressure_pa", "1013.25", "80000"});
  refuse("warmer_k = 288.15", {"warmer_k", "288.15"});
  refuse("errors = { noise_pa = -1.0 }", {"noise_pa", "-1"});
  const auto high = std::make_shared<WavyMotion>();
  high->place[2].middle = 90000.0;
  expect_error(core::ErrorKind::Input, {"80000", "sea level"}, [&] { measure("", high, 1.0, 1); });
}

TEST_F(Barometer, ShippedSetsAreRead) {
  const auto pressures =
      measure("errors = \"" TERRACAST_SOURCE_DIR "/configs/sensors/px4_gazebo/barometer.toml\"",
              figure_of_eight(), 10.0, 2);
  EXPECT_NE(pressures[0].shown_pa, pressures[0].true_pa);
}

}  // namespace
}  // namespace terracast::test
