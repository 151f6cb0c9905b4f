// Where beams are led, against closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "core/choice.h"
#include "core/toml_reader.h"
#include "sensors/lidar/pattern.h"

namespace terracast::test {
namespace {

using sensors::lidar::Pulse;
using sensors::lidar::ScanPatternInfo;

constexpr double kDegree = std::numbers::pi / 180.0;
// Sines and cosines of doubles, and phases of a thousand turns: 1e-13 of one.
constexpr double kRounding_rad = 1e-12;

struct Pattern {
  core::Choice<ScanPatternInfo> choice;
  void describe(core::SchemaVisitor& visit) {
    choice.describe(visit, "pattern", "pattern", "", sensors::lidar::scan_patterns());
  }
  void validate() const { choice.validate(); }
};

Pattern pattern_of(const std::string& keys) {
  Pattern pattern;
  core::TomlDocument::parse(keys, "keys").read(pattern);
  return pattern;
}

double azimuth_of(const Pulse& pulse) {
  return std::atan2(pulse.direction.y(), pulse.direction.x());
}
double elevation_of(const Pulse& pulse) { return std::asin(pulse.direction.z()); }
/// Between directions, for small angles too.
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

TEST(LidarPatterns, EveryPulseLeavesOnceInOrderWithinItsScan) {
  for (const char* keys :
       {"pattern = \"cone\"\npulse_hz = 33333.0", "pattern = \"oscillating\"\npulse_hz = 12345.6",
        "pattern = \"polygon\"\npulse_hz = 7001.0", "pattern = \"risley\"\npulse_hz = 999.5",
        "pattern = \"raster\"\nrows = 7\ncolumns = 9",
        "pattern = \"spinning\"\ncycle_us = 55.296\nelevation_deg = [1.0, 2.0, 3.0]\nfiring_us = "
        "[30.0, 0.0, 54.0]",
        "pattern = \"spinning\"\ncolumns = 512"}) {
    const Pattern pattern = pattern_of(keys);
    constexpr double kRate_hz = 9.7;
    constexpr int kScans = 40;
    std::size_t count = 0;
    double last_s = -1.0;
    for (int scan = 0; scan < kScans; ++scan)
      for (const Pulse& pulse : pattern.choice->pulses(scan, kRate_hz)) {
        EXPECT_GE(pulse.time_s, scan / kRate_hz) << keys;
        EXPECT_LT(pulse.time_s, (scan + 1) / kRate_hz) << keys;
        EXPECT_GE(pulse.time_s, last_s) << keys;
        EXPECT_NEAR(pulse.direction.norm(), 1.0, 1e-14) << keys;
        last_s = pulse.time_s;
        ++count;
      }
    // All that leave in the time, but for those at its ends.
    EXPECT_NEAR(static_cast<double>(count),
                pattern.choice->pulses_per_s(kRate_hz) * kScans / kRate_hz, 3.0)
        << keys;
  }
}

TEST(LidarPatterns, AHeadOfColumnsHasAsManyInEveryTurn) {
  const Pattern pattern =
      pattern_of("pattern = \"spinning\"\ncolumns = 1024\nelevation_deg = [-10.0, 0.0, 10.0]");
  for (const double rate_hz : {10.0, 20.0, 9.9999, 7.3})
    for (const int scan : {0, 1, 2, 3, 77, 100'003}) {
      const std::vector<Pulse> pulses = pattern.choice->pulses(scan, rate_hz);
      ASSERT_EQ(pulses.size(), 3072U);
      EXPECT_EQ(pulses.front().time_s, scan / rate_hz);
      for (std::size_t i = 0; i < pulses.size(); ++i) {
        EXPECT_EQ(pulses[i].ring, i % 3);
        EXPECT_NEAR(elevation_of(pulses[i]), (static_cast<double>(i % 3) - 1.0) * 10.0 * kDegree,
                    kRounding_rad);
        // Clockwise; a hundred thousand turns leave 1e-10 of one.
        const double turned = -2.0 * std::numbers::pi * static_cast<double>(i / 3) / 1024.0;
        EXPECT_NEAR(std::remainder(azimuth_of(pulses[i]) - turned, 2.0 * std::numbers::pi), 0.0,
                    scan < 100 ? kRounding_rad : 1e-9);
      }
    }
}

// 55.296 us a cycle are 1808.4 cycles in a turn of 0.1 s, as the manual of the VLP-16 (63-9243) has them.
TEST(LidarPatterns, CyclesOfTheirOwnTimeGoOnFromTurnToTurn) {
  const Pattern pattern = pattern_of(
      "pattern = \"spinning\"\ncycle_us = 55.296\nelevation_deg = [-15.0, 1.0]\nfiring_us = [0.0, "
      "2.304]");
  std::size_t count = 0;
  for (int scan = 0; scan < 100; ++scan) {
    const std::size_t size = pattern.choice->pulses(scan, 10.0).size();
    EXPECT_GE(size, 2U * 1808U);
    EXPECT_LE(size, 2U * 1809U);
    count += size;
  }
  EXPECT_NEAR(static_cast<double>(count), 2.0 * 100.0 * 0.1 / 55.296e-6, 2.0);
}

TEST(LidarPatterns, AHeadTurnsEitherWayFromWhereItStarts) {
  for (const double sense : {1.0, -1.0}) {
    const Pattern pattern =
        pattern_of(fmt::format("pattern = \"spinning\"\ncolumns = 8\nelevation_deg = "
                               "[0.0]\nacross_mm = [50.0]\norigin_mm = "
                               "100.0\nvertical_mm = [7.0]\nstart_deg = 30.0\nturning = \"{}\"",
                               sense > 0.0 ? "counterclockwise" : "clockwise"));
    const std::vector<Pulse> pulses = pattern.choice->pulses(0, 10.0);
    ASSERT_EQ(pulses.size(), 8U);
    for (std::size_t i = 0; i < 8; ++i) {
      const double head = (30.0 + sense * 45.0 * static_cast<double>(i)) * kDegree;
      EXPECT_LT((pulses[i].direction - Eigen::Vector3d(std::cos(head), std::sin(head), 0.0)).norm(),
                1e-12);
      // 100 mm ahead and 50 mm to the left of that.
      EXPECT_LT((pulses[i].origin_m - Eigen::Vector3d(0.1 * std::cos(head) - 0.05 * std::sin(head),
                                                      0.1 * std::sin(head) + 0.05 * std::cos(head),
                                                      0.007))
                    .norm(),
                1e-12);
    }
  }
}

// Rates whose quotients round to either side of lines' borders.
TEST(LidarPatterns, LinesKeepTheirFirstPulse) {
  for (const auto& [rate_hz, pulse_hz] : {std::pair{33.3, 3330.0}, {9.7, 970.0}, {16.7, 167e3}}) {
    const Pattern pattern =
        pattern_of(fmt::format("pattern = \"polygon\"\npulse_hz = {}\nfield_deg = 50.0", pulse_hz));
    const auto per_line = static_cast<std::size_t>(std::lround(pulse_hz / rate_hz));
    for (int line = 0; line < 1000; ++line) {
      const std::vector<Pulse> pulses = pattern.choice->pulses(line, rate_hz);
      ASSERT_EQ(pulses.size(), per_line) << line;
      EXPECT_GE(pulses.front().time_s, line / rate_hz);
      EXPECT_LT(pulses.back().time_s, (line + 1) / rate_hz);
      EXPECT_NEAR(azimuth_of(pulses.front()), -25.0 * kDegree, 1e-8);
    }
  }
}

TEST(LidarPatterns, AConeHasOneAngleAndEvenSteps) {
  const Pattern pattern =
      pattern_of("pattern = \"cone\"\npulse_hz = 1000.0\nhalf_angle_deg = 20.0");
  const std::vector<Pulse> pulses = pattern.choice->pulses(3, 10.0);
  ASSERT_EQ(pulses.size(), 100U);
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    EXPECT_NEAR(angle_between(pulses[i].direction, Eigen::Vector3d::UnitX()), 20.0 * kDegree,
                kRounding_rad);
    const double round = std::atan2(pulses[i].direction.z(), pulses[i].direction.y());
    EXPECT_NEAR(std::remainder(round - 2.0 * std::numbers::pi * static_cast<double>(i) / 100.0,
                               2.0 * std::numbers::pi),
                0.0, kRounding_rad);
  }
}

TEST(LidarPatterns, APolygonDrawsEvenLinesFromRightToLeft) {
  const Pattern pattern =
      pattern_of("pattern = \"polygon\"\npulse_hz = 1000.0\nfield_deg = 60.0\nline_share = 0.75");
  const std::vector<Pulse> pulses = pattern.choice->pulses(5, 10.0);
  ASSERT_EQ(pulses.size(), 75U);
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    EXPECT_NEAR(azimuth_of(pulses[i]), (-30.0 + 0.8 * static_cast<double>(i)) * kDegree, 1e-11);
    EXPECT_NEAR(elevation_of(pulses[i]), 0.0, kRounding_rad);
  }
}

TEST(LidarPatterns, AMirrorSwingsToBothSidesAndBack) {
  const std::string keys =
      "pattern = \"oscillating\"\npulse_hz = 800.0\nfield_deg = 40.0\nswing = ";
  const Pattern sine = pattern_of(keys + "\"sine\"");
  const Pattern triangle = pattern_of(keys + "\"triangle\"");
  const std::vector<Pulse> by_sine = sine.choice->pulses(2, 10.0);
  const std::vector<Pulse> by_triangle = triangle.choice->pulses(2, 10.0);
  ASSERT_EQ(by_sine.size(), 80U);
  ASSERT_EQ(by_triangle.size(), 80U);
  for (std::size_t i = 0; i < 80; ++i) {
    const double phase = static_cast<double>(i) / 80.0;
    EXPECT_NEAR(azimuth_of(by_sine[i]), 20.0 * kDegree * std::sin(2.0 * std::numbers::pi * phase),
                kRounding_rad);
    // The triangle is the arc sine of the sine.
    EXPECT_NEAR(azimuth_of(by_triangle[i]),
                20.0 * kDegree * std::asin(std::sin(2.0 * std::numbers::pi * phase)) /
                    (0.5 * std::numbers::pi),
                1e-9);
  }
}

TEST(LidarPatterns, ARasterHasItsDirectionsInTurnOrAtOnce) {
  const std::string keys =
      "pattern = \"raster\"\nwidth_deg = 60.0\nheight_deg = 20.0\ncolumns = 6\nrows = 4\n";
  for (const bool is_flash : {false, true}) {
    const Pattern pattern = pattern_of(keys + (is_flash ? "is_flash = true" : ""));
    const std::vector<Pulse> pulses = pattern.choice->pulses(2, 10.0);
    ASSERT_EQ(pulses.size(), 24U);
    for (std::size_t i = 0; i < 24; ++i) {
      const auto column = static_cast<double>(i % 6), row = static_cast<double>(i / 6);
      EXPECT_NEAR(azimuth_of(pulses[i]), (25.0 - 10.0 * column) * kDegree, kRounding_rad);
      EXPECT_NEAR(elevation_of(pulses[i]), (7.5 - 5.0 * row) * kDegree, kRounding_rad);
      EXPECT_NEAR(pulses[i].time_s, 0.2 + (is_flash ? 0.0 : 0.1 * static_cast<double>(i) / 24.0),
                  1e-15);
      EXPECT_EQ(pulses[i].ring, static_cast<int>(row));
    }
  }
}

// Snell's law in a plane: a wedge with its first face square to the beam turns it by asin(n sin A) - A.
TEST(LidarPatterns, OneWedgeBendsTheBeamByItsAngle) {
  for (const double wedge_deg : {0.5, 5.0, 18.7481, 30.0}) {
    const Pattern pattern =
        pattern_of(fmt::format("pattern = \"risley\"\npulse_hz = 1000.0\nturns_hz = [10.0]\n"
                               "wedge_deg = [{}]\nrefractive_index = 1.51",
                               wedge_deg));
    const double expected = std::asin(1.51 * std::sin(wedge_deg * kDegree)) - wedge_deg * kDegree;
    const std::vector<Pulse> pulses = pattern.choice->pulses(0, 10.0);
    ASSERT_EQ(pulses.size(), 100U);
    for (std::size_t i = 0; i < pulses.size(); ++i) {
      EXPECT_NEAR(angle_between(pulses[i].direction, Eigen::Vector3d::UnitX()), expected,
                  kRounding_rad);
      const double round = std::atan2(pulses[i].direction.z(), pulses[i].direction.y());
      const double step = 2.0 * std::numbers::pi * static_cast<double>(i) / 100.0;
      // To the thick side of the wedge, which is left at first and goes counterclockwise seen from ahead.
      EXPECT_NEAR(std::cos(round - step), 1.0, 1e-12);
    }
  }
}

// Thin wedges turn the beam by (n - 1) A each, as vectors that turn: rosettes between their sum and their difference.
TEST(LidarPatterns, ThinWedgesDrawTheSumOfTwoVectors) {
  const Pattern pattern = pattern_of(
      "pattern = \"risley\"\npulse_hz = 2000.0\nturns_hz = [7.0, -4.0]\nwedge_deg = [0.4, 0.3]\n"
      "refractive_index = 1.5");
  for (const Pulse& pulse : pattern.choice->pulses(0, 1.0)) {
    const double a = 2.0 * std::numbers::pi * 7.0 * pulse.time_s;
    const double b = -2.0 * std::numbers::pi * 4.0 * pulse.time_s;
    const Eigen::Vector2d thin = 0.5 * kDegree *
                                 (0.4 * Eigen::Vector2d(std::cos(a), std::sin(a)) +
                                  0.3 * Eigen::Vector2d(std::cos(b), std::sin(b)));
    const Eigen::Vector2d seen = pulse.direction.tail<2>();
    // Of third order in angles of 7e-3 rad: 4e-7.
    EXPECT_LT((seen - thin).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace terracast::test
