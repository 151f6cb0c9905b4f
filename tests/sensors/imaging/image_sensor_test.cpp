#include "sensors/camera/imaging/image_sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "sensors/deviates.h"

namespace terracast::sensors {
namespace {

constexpr int kSide = 128;

ImageSensorOptions bright_sensor() {
  ImageSensorOptions options;
  options.bits = 12;
  options.black_level_dn = 128.0;
  options.saturation_exposure = 1.0;
  options.full_well_e = 10000.0;
  options.mosaic = "rggb";  // one number a pixel
  return options;
}

core::ImageF even(float exposed) { return core::ImageF(kSide, kSide, 3, exposed); }

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

template <class Values>
Moments moments_of(const Values& values) {
  Moments moments;
  double count = 0.0;
  for (const auto value : values) {
    const double before = static_cast<double>(value) - moments.mean;
    moments.mean += before / ++count;
    moments.variance += before * (static_cast<double>(value) - moments.mean);
  }
  moments.variance /= count - 1.0;
  return moments;
}

TEST(Deviates, NormalIsTheInverseOfTheErrorFunction) {
  for (double unit = 1e-12; unit < 1.0; unit = unit < 0.01 ? 1.7 * unit : unit + 0.0037) {
    const double x = normal_deviate(unit);
    // A deviate that errs by e has a share that errs by the density times e.
    const double density = std::exp(-0.5 * x * x) / std::sqrt(2.0 * M_PI);
    EXPECT_NEAR(0.5 * std::erfc(-x / std::sqrt(2.0)), unit, 1e-6 * density) << unit;
    EXPECT_NEAR(normal_deviate(1.0 - unit), -x, 1e-6 + 1e-15 / density) << unit;
  }
}

/// Shares of each count among evenly spaced units against the formula.
TEST(Deviates, PoissonHasItsShares) {
  constexpr int kUnits = 400000;
  for (const double mean : {0.02, 0.7, 4.0, 31.9, 32.1, 100.0, 3000.0}) {
    std::map<int, int> seen;
    double first = 0.0;
    double second = 0.0;
    double third = 0.0;
    for (int i = 0; i < kUnits; ++i) {
      const double count = poisson_deviate(mean, (i + 0.5) / kUnits);
      ++seen[static_cast<int>(count)];
      first += count - mean;
      second += std::pow(count - mean, 2);
      third += std::pow(count - mean, 3);
    }
    double wrong = 0.0;
    for (const auto& [count, times] : seen) {
      const double share = std::exp(count * std::log(mean) - mean - std::lgamma(count + 1.0));
      wrong += 0.5 * std::abs(static_cast<double>(times) / kUnits - share);
    }
    // Each count's share is cut to 1 / kUnits at both ends.
    const double resolved = static_cast<double>(seen.size()) / kUnits;
    EXPECT_LT(wrong, resolved + (mean > 32.0 ? 0.1 / mean : 0.0)) << mean;
    // Mean, variance and third central moment of Poisson's distribution are all the mean.
    EXPECT_NEAR(first / kUnits, 0.0, 2e-3 * std::sqrt(mean)) << mean;
    EXPECT_NEAR(second / kUnits / mean, 1.0, 2e-3) << mean;
    EXPECT_NEAR(third / kUnits / mean, 1.0, 0.02) << mean;
  }
}

/// Variance over mean is a line: its slope the system gain, its height the noise of reading and of steps.
TEST(ImageSensor, HasThePhotonTransferCurve) {
  ImageSensorOptions options = bright_sensor();
  options.read_noise_e = 12.0;
  options.dark_signal_e = 30.0;
  options.gain = 2.0;
  const ImageSensor sensor(options, 7, 1);
  const double gain = (4095.0 - 128.0) * 2.0 / 10000.0;
  EXPECT_DOUBLE_EQ(sensor.dn_per_electron(), gain);
  constexpr double kCount = kSide * kSide;
  for (const float exposed : {0.0f, 0.01f, 0.1f, 0.3f, 0.8f}) {
    const Moments numbers = moments_of(sensor.read(even(exposed), 3).data());
    const double electrons = static_cast<double>(exposed) * 5000.0 + 30.0;
    const double variance = gain * gain * (electrons + 144.0) + 1.0 / 12.0;
    EXPECT_NEAR(numbers.mean, 128.0 + gain * electrons, 4.0 * std::sqrt(variance / kCount));
    EXPECT_NEAR(numbers.variance, variance, 4.0 * variance * std::sqrt(2.0 / kCount)) << exposed;
    EXPECT_NEAR(sensor.exposure_of(numbers.mean), exposed,
                4.0 * std::sqrt(variance / kCount) / (4095.0 - 128.0));
  }
}

TEST(ImageSensor, FixedPatternsStayWhenNoiseIsAveragedOut) {
  ImageSensorOptions options = bright_sensor();
  options.prnu_percent = 2.0;
  options.dsnu_e = 40.0;
  const ImageSensor sensor(options, 7, 1);
  constexpr int kFrames = 64;
  const auto averaged = [&](float exposed) {
    std::vector<double> sums(kSide * kSide);
    for (int frame = 0; frame < kFrames; ++frame) {
      const core::Image16 numbers = sensor.read(even(exposed), frame);
      for (std::size_t i = 0; i < sums.size(); ++i)
        sums[i] += static_cast<double>(numbers.data()[i]) / kFrames;
    }
    return sums;
  };
  const double gain = sensor.dn_per_electron();
  const double spread = 4.0 * std::sqrt(2.0 / (kSide * kSide));
  // In the dark nothing differs from frame to frame: steps stay as well.
  const double dark = gain * gain * 40.0 * 40.0 + 1.0 / 12.0;
  EXPECT_NEAR(moments_of(averaged(0.0f)).variance, dark, spread * dark);
  const double left = (gain * gain * 5000.0 + 1.0 / 12.0) / kFrames;
  const double bright = gain * gain * (100.0 * 100.0 + 40.0 * 40.0) + left;
  EXPECT_NEAR(moments_of(averaged(0.5f)).variance, bright, spread * bright);
  const ImageSensor other(options, 7, 2);
  EXPECT_NE(other.read(even(0.5f), 0), sensor.read(even(0.5f), 0));
}

TEST(ImageSensor, WithoutElectronsQuantisesAlone) {
  ImageSensorOptions options = bright_sensor();
  options.full_well_e = 0.0;
  options.bits = 8;
  options.black_level_dn = 5.0;
  const ImageSensor sensor(options, 7, 1);
  core::ImageF ramp(1000, 1, 3);
  for (int x = 0; x < 1000; ++x)
    for (int k = 0; k < 3; ++k) ramp(x, 0, k) = 0.001f * static_cast<float>(x) * 1.1f;
  const core::Image16 numbers = sensor.read(ramp, 0);
  for (int x = 0; x < 1000; ++x) {
    const double level = 5.0 + 250.0 * static_cast<double>(ramp(x, 0));
    EXPECT_LE(std::abs(numbers(x, 0) - std::min(level, 255.0)), 0.5 + 1e-4) << x;
  }
  EXPECT_EQ(numbers(0, 0), 5);
  EXPECT_EQ(numbers(999, 0), 255);
}

TEST(ImageSensor, DefectsAreListedAndSeen) {
  ImageSensorOptions options = bright_sensor();
  options.dead_share = 0.004;
  options.hot_share = 0.002;
  for (const char* mosaic : {"rggb", ""}) {
    options.mosaic = mosaic;
    const ImageSensor sensor(options, 3, 9);
    const ImageSensor::Defects defects = sensor.find_defects(kSide, kSide);
    const core::Image16 numbers = sensor.read(even(0.5f), 11);
    std::set<std::int64_t> dead;
    std::set<std::int64_t> hot;
    for (std::size_t i = 0; i < numbers.data().size(); ++i) {
      if (numbers.data()[i] < 300) dead.insert(static_cast<std::int64_t>(i));
      if (numbers.data()[i] == 4095) hot.insert(static_cast<std::int64_t>(i));
    }
    EXPECT_EQ(std::set(defects.dead.begin(), defects.dead.end()), dead);
    EXPECT_EQ(std::set(defects.hot.begin(), defects.hot.end()), hot);
    const auto sites = static_cast<double>(numbers.data().size());
    EXPECT_NEAR(static_cast<double>(dead.size()), 0.004 * sites, 4.0 * std::sqrt(0.004 * sites));
    EXPECT_NEAR(static_cast<double>(hot.size()), 0.002 * sites, 4.0 * std::sqrt(0.002 * sites));
  }
}

TEST(ImageSensor, NumbersDoNotDependOnThreads) {
  ImageSensorOptions options = bright_sensor();
  options.read_noise_e = 3.0;
  const ImageSensor sensor(options, 3, 9);
  const core::ThreadLimit one(1);
  const core::Image16 alone = sensor.read(even(0.3f), 2);
  {
    const core::ThreadLimit two(2);
    EXPECT_EQ(sensor.read(even(0.3f), 2), alone);
  }
  EXPECT_NE(sensor.read(even(0.3f), 3), alone);
}

TEST(ImageSensorOptions, ThatCannotBeAreRefused) {
  const auto message_of = [](const ImageSensorOptions& options) -> std::string {
    try {
      options.validate();
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Config);
      return error.what();
    }
    return "";
  };
  ImageSensorOptions options;
  EXPECT_EQ(message_of(options), "");
  options.full_well_e = 1000.0;
  EXPECT_NE(message_of(options).find("bits = 0 leaves it out"), std::string::npos);
  options.bits = 4;
  EXPECT_NE(message_of(options).find("bits = 4; it takes 8 to 16"), std::string::npos);
  options.bits = 8;
  EXPECT_EQ(message_of(options), "");
  options.black_level_dn = 255.0;
  EXPECT_NE(message_of(options).find("leaves nothing of the 256 numbers"), std::string::npos);
  options.black_level_dn = 0.0;
  options.full_well_e = 0.0;
  options.read_noise_e = 2.0;
  EXPECT_NE(message_of(options).find("without full_well_e"), std::string::npos);
}

TEST(Mosaic, PutsEachColorInItsPlace) {
  core::ImageF exposed(6, 4, 3);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x)
      for (int k = 0; k < 3; ++k) exposed(x, y, k) = 0.25f * static_cast<float>(k + 1);
  ImageSensorOptions options = bright_sensor();
  options.full_well_e = 0.0;
  options.black_level_dn = 0.0;
  options.bits = 8;
  // By the places of Bayer's red, and blue across from it.
  const std::map<std::string, std::pair<int, int>> place_of_red = {
      {"rggb", {0, 0}}, {"grbg", {1, 0}}, {"gbrg", {0, 1}}, {"bggr", {1, 1}}};
  for (const auto& [name, red] : place_of_red) {
    options.mosaic = name;
    const core::Image16 numbers = ImageSensor(options, 1, 1).read(exposed, 0);
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 6; ++x) {
        const bool is_column = x % 2 == red.first;
        const bool is_row = y % 2 == red.second;
        const int expected = is_column && is_row ? 64 : is_column == is_row ? 191 : 128;
        EXPECT_EQ(numbers(x, y), expected) << name << " " << x << " " << y;
      }
  }
}

TEST(Mosaic, GivesSmoothColorsBack) {
  core::ImageF colors(24, 20, 3);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 24; ++x) {
      const float slope = 0.01f * static_cast<float>(x) + 0.02f * static_cast<float>(y);
      colors(x, y, 0) = 0.2f + slope;
      colors(x, y, 1) = 0.1f + slope;
      colors(x, y, 2) = 0.4f + slope;
    }
  for (const char* name : {"rggb", "bggr", "grbg", "gbrg"}) {
    const Mosaic mosaic(name);
    core::ImageF seen(24, 20);
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 24; ++x) seen(x, y) = colors(x, y, mosaic.channel_at(x, y));
    const core::ImageF image = mosaic.demosaiced(seen);
    for (int y = 2; y < 18; ++y)
      for (int x = 2; x < 22; ++x)
        for (int k = 0; k < 3; ++k)
          EXPECT_NEAR(image(x, y, k), colors(x, y, k), 1e-6f) << name << x << " " << y << " " << k;
  }
}

}  // namespace
}  // namespace terracast::sensors
