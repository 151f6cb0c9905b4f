// SBETs of POSPac, written here from their definition: what is read of them, and what is refused.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geo/sun.h"
#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// A record of an SBET whose fields are named.
struct SbetRecord {
  double time_s = 0.0, lat = 0.74, lon = 0.026, altitude_m = 1500.0;
  double vx = 0.0, vy = 0.0, vz = 0.0;
  double roll = 0.0, pitch = 0.0, heading = 0.0, wander = 0.0;
  double ax = 0.0, ay = 0.0, az = 0.0, wx = 0.0, wy = 0.0, wz = 0.0;

  std::string bytes() const {
    const double fields[] = {time_s,  lat,    lon, altitude_m, vx, vy, vz, roll, pitch,
                             heading, wander, ax,  ay,         az, wx, wy, wz};
    static_assert(sizeof(fields) == 136);
    return {reinterpret_cast<const char*>(fields), sizeof(fields)};
  }
};

class SbetFiles : public test::Recordings {};

TEST_F(SbetFiles, RadiansAndTheWanderAngleGivePlaceAndAttitude) {
  const SbetRecord record{.time_s = 1000.25,
                          .vx = 30.0,
                          .vy = -40.0,
                          .roll = 0.1,
                          .pitch = 0.2,
                          .heading = 1.5,
                          .wander = 0.4};
  const FixTable table = read("sbet", "", record.bytes());
  ASSERT_EQ(table.fixes.size(), 1u);
  const Fix& fix = table.fixes[0];
  EXPECT_EQ(fix.time_s, 1000.25);
  EXPECT_NEAR(fix.place.x(), 0.74 / kDegree, 1e-12);
  EXPECT_NEAR(fix.place.y(), 0.026 / kDegree, 1e-12);
  EXPECT_EQ(fix.place.z(), 1500.0);
  EXPECT_EQ(fix.speed_mps, 50.0);
  EXPECT_FALSE(table.has_utc());
  // True heading 1.1 rad, nose up by 0.2, right side down by 0.1.
  const Eigen::Vector3d forward = *fix.attitude * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(forward.x(), forward.y()), 1.1, 1e-12);
  EXPECT_NEAR(forward.z(), std::sin(0.2), 1e-12);
  const Eigen::Vector3d right = *fix.attitude * -Eigen::Vector3d::UnitY();
  EXPECT_NEAR(right.z(), -std::sin(0.1) * std::cos(0.2), 1e-12);
}

// Velocities are about the same wandering axes: north is x cos w - y sin w, east -x sin w - y cos w (y is to the left). What
// flies straight ahead has its velocity along its nose.
TEST_F(SbetFiles, VelocitiesAlongTheNoseAgreeWithTheHeading) {
  for (const double wander : {0.0, 0.7, -2.0}) {
    const double platform_heading = 0.9;
    const SbetRecord record{.vx = 20.0 * std::cos(platform_heading),
                            .vy = -20.0 * std::sin(platform_heading),
                            .heading = platform_heading,
                            .wander = wander};
    const double north = record.vx * std::cos(wander) - record.vy * std::sin(wander);
    const double east = -record.vx * std::sin(wander) - record.vy * std::cos(wander);
    const Fix fix = read("sbet", "", record.bytes()).fixes.at(0);
    const Eigen::Vector3d forward = *fix.attitude * Eigen::Vector3d::UnitX();
    EXPECT_LT((forward - Eigen::Vector3d(east, north, 0.0) / 20.0).norm(), 1e-12) << wander;
  }
}

TEST_F(SbetFiles, ADateMakesSecondsOfTheWeekUtc) {
  // 2024-06-05 is a Wednesday; its week began on Sunday, 2024-06-02. GPS was 18 s ahead.
  const double start = unix_seconds_from_utc("2024-06-02T00:00:00Z") - 18.0;
  std::string bytes;
  for (const double time_s : {259200.0, 604799.5, 0.5})
    bytes += SbetRecord{.time_s = time_s}.bytes();
  for (const char* date : {"2024-06-05", "2024-06-02", "2024-06-08"}) {
    const FixTable table = read("sbet", fmt::format("gps_date = \"{}\"", date), bytes);
    EXPECT_TRUE(table.has_utc());
    EXPECT_EQ(table.zero_unix_s, start) << date;
    EXPECT_EQ(table.fixes[0].time_s, 259200.0) << date;
    EXPECT_EQ(table.fixes[1].time_s, 604799.5) << date;
    EXPECT_EQ(table.fixes[2].time_s, 604800.5) << date;  // the week has ended
  }
  const FixTable of_day = read("sbet", "gps_date = \"2024-06-05\"\ntime_in = \"gps_day\"",
                               SbetRecord{.time_s = 3600.0}.bytes());
  EXPECT_EQ(*of_day.zero_unix_s + of_day.fixes[0].time_s,
            unix_seconds_from_utc("2024-06-05T01:00:00Z") - 18.0);
  EXPECT_NE(refused("sbet", "gps_date = \"June\"", bytes, core::ErrorKind::Config).find("June"),
            std::string::npos);
}

// Seconds since 1970 are rounded to 2.4e-7 s, which at 200 records a second would be accelerations of 0.5 m/s^2.
TEST_F(SbetFiles, ADateLeavesUniformMotionAtTwoHundredHertzUniform) {
  constexpr double kSpeed_mps = 20.0, kRate_hz = 200.0, kEarth_m = 6371000.0;
  std::string bytes;
  for (int i = 0; i <= 1000; ++i)
    bytes += SbetRecord{.time_s = 1000.25 + i / kRate_hz,
                        .lat = 42.5 * kDegree + i * kSpeed_mps / kRate_hz / kEarth_m,
                        .lon = 1.5 * kDegree}
                 .bytes();
  const auto motion = test::trajectory_from(
      fmt::format("kind = \"recorded\"\nfile = \"{}\"\nformat = \"sbet\"\ngps_date = "
                  "\"2024-06-05\"\nsigma_m = 0.0\n",
                  written("flight.out", bytes).string()),
      test::GroundWorld());
  EXPECT_NEAR(*motion->utc_start_unix_s(),
              unix_seconds_from_utc("2024-06-02T00:00:00Z") - 18.0 + 1000.25, 1e-6);
  double sum = 0.0;
  constexpr int kNumSamples = 800;
  for (int i = 0; i < kNumSamples; ++i)
    sum += motion->at(0.5 + i / kRate_hz).acceleration_world_mps2.squaredNorm();
  EXPECT_LT(std::sqrt(sum / kNumSamples), 1e-3);
}

TEST_F(SbetFiles, WhatIsNoSbetIsRefusedWithItsByte) {
  const std::string two = SbetRecord{}.bytes() + SbetRecord{.time_s = 1.0}.bytes();
  EXPECT_NE(refused("sbet", "", two.substr(0, 200)).find("byte 136"), std::string::npos);
  EXPECT_NE(refused("sbet", "", "").find("0 bytes"), std::string::npos);
  const std::string degrees =
      refused("sbet", "", two + SbetRecord{.time_s = 2.0, .lat = 42.5}.bytes());
  EXPECT_NE(degrees.find("record 2 (counted from 0) at byte 272"), std::string::npos) << degrees;
  EXPECT_NE(degrees.find("radians"), std::string::npos) << degrees;
  EXPECT_NE(refused("sbet", "", SbetRecord{.roll = std::nan("")}.bytes()).find("roll is nan"),
            std::string::npos);
  EXPECT_NO_THROW(read("sbet", "", SbetRecord{.altitude_m = std::nan("")}.bytes(), "none"));
}

}  // namespace
}  // namespace terracast::geo
