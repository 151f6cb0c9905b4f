// Signals of satellites: their noise against its law, clocks, and rows that do not depend on which epochs are measured
// together. Orbits are in tests/geo, RTKLIB and the world that hides satellites in tests/e2e.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <vector>

#include "tests/support/expect_error.h"
#include "tests/support/sensor_flight.h"

namespace terracast::test {
namespace {

constexpr std::size_t kNumChannels = 23;
constexpr double kLight_mps = 299792458.0;
constexpr double kWave_m = kLight_mps / 1575.42e6;

class GnssObservations : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/usr/share/proj/egm96_15.gtx"))
      GTEST_SKIP() << "no grid of EGM96: install proj-data";
  }
  capture::Samples scan(const std::string& keys, double rate_hz,
                        const capture::TickRange& ticks) const {
    return flight_.scan("gnss_observations", keys, figure_of_eight(), rate_hz, ticks);
  }

 private:
  SensorFlight flight_;
};

struct Row {
  int prn;
  double elevation_rad, pseudorange_m, carrier_cycles, doppler_hz;
  double range_m, range_rate_mps, receiver_clock_s, satellite_clock_s, ionosphere_m, troposphere_m;
  bool is_visible;
  explicit Row(const double* values)
      : prn(static_cast<int>(values[0])),
        elevation_rad(values[2] * std::numbers::pi / 180.0),
        pseudorange_m(values[6]),
        carrier_cycles(values[7]),
        doppler_hz(values[8]),
        range_m(values[9]),
        range_rate_mps(values[10]),
        receiver_clock_s(values[11]),
        satellite_clock_s(values[12]),
        ionosphere_m(values[13]),
        troposphere_m(values[14]),
        is_visible(values[3] != 0.0) {}
};

TEST_F(GnssObservations, NoiseGrowsTowardsTheHorizon) {
  const capture::Samples samples = scan(
      "pseudorange_noise_m = 0.5\ncarrier_noise_mm = 3.0\ndoppler_noise_hz = 0.2\n"
      "clock_offset_us = -700.0\nclock_drift_ppb = 1000.0\n",
      1.0, {.first = 0, .end = 900});
  std::map<int, double> whole_waves;
  double code2 = 0.0, carrier2 = 0.0, doppler2 = 0.0, count = 0.0;
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    const Row row(&samples.values[kNumChannels * i]);
    if (!row.is_visible) continue;
    EXPECT_NEAR(row.receiver_clock_s, -700e-6 + 1e-6 * samples.times_s[i], 1e-18);
    const double clocks_m = kLight_mps * (row.receiver_clock_s - row.satellite_clock_s);
    const double sine = std::sin(row.elevation_rad);
    const double code_m = row.range_m + clocks_m + row.ionosphere_m + row.troposphere_m;
    const double carrier_m = row.range_m + clocks_m - row.ionosphere_m + row.troposphere_m;
    const double waves = row.carrier_cycles - carrier_m / kWave_m;
    const double whole = whole_waves.try_emplace(row.prn, std::round(waves)).first->second;
    const auto add = [sine](double& sum, double off, double deviation) {
      sum += std::pow(off / deviation * sine, 2);
    };
    add(code2, row.pseudorange_m - code_m, 0.5);
    add(carrier2, (waves - whole) * kWave_m, 3e-3);
    add(doppler2, row.doppler_hz + (row.range_rate_mps + 1e-6 * kLight_mps) / kWave_m, 0.2);
    count += 1.0;
  }
  EXPECT_GT(count, 5000.0);
  EXPECT_GE(whole_waves.size(), 6U);
  // Mean squares of normal deviates scatter by sqrt(2 / n).
  for (const double sum : {code2, carrier2, doppler2})
    EXPECT_NEAR(sum / count, 1.0, 4.0 * std::sqrt(2.0 / count));
}

TEST_F(GnssObservations, EpochsDoNotDependOnEachOther) {
  const std::string keys = "pseudorange_noise_m = 0.5\n";
  const capture::Samples together = scan(keys, 5.0, {.first = 0, .end = 40});
  capture::Samples apart = scan(keys, 5.0, {.first = 0, .end = 13});
  const capture::Samples later = scan(keys, 5.0, {.first = 13, .end = 40});
  apart.times_s.insert(apart.times_s.end(), later.times_s.begin(), later.times_s.end());
  apart.values.insert(apart.values.end(), later.values.begin(), later.values.end());
  EXPECT_EQ(together, apart);
}

TEST_F(GnssObservations, KeysOutOfRangeAreRefused) {
  expect_error(core::ErrorKind::Config, {"mask_deg"},
               [] { sensor_of("gnss_observations", "mask_deg = 0.0\n"); });
  expect_error(core::ErrorKind::Config, {"pseudorange_noise_m"},
               [] { sensor_of("gnss_observations", "pseudorange_noise_m = -1.0\n"); });
}

}  // namespace
}  // namespace terracast::test
