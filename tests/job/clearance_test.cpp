#include "job/clearance.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/error.h"
#include "core/random.h"
#include "core/toml_reader.h"
#include "geo/paths/recorded_motion.h"
#include "tests/support/expect_error.h"
#include "tests/support/settled_world.h"
#include "tests/support/tiny_world.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
using test::SettledWorld;
using testing::HasSubstr;

constexpr std::uint64_t kSeed = 35;

/// The motion of a `[[trajectories]]`, without a look at the ground.
std::shared_ptr<const geo::Trajectory> motion_of(const std::string& toml,
                                                 const geo::WorldFrame& frame) {
  geo::TrajectoryOptions options;
  core::TomlDocument::parse(toml, "flight.toml").read(options);
  return options.kind_options().build({.frame = frame,
                                       .ground_height_m = [](double, double) { return -1000.0; },
                                       .geoid = nullptr});
}

/// A flight through places of the world.
std::string waypoints(const std::vector<Vector3d>& places, const geo::WorldFrame& frame,
                      const std::string& keys = "speed_mps = 10.0\n") {
  std::string list;
  for (const Vector3d& place : places) {
    const geo::Geodetic at = frame.geodetic_from_world(place);
    list += fmt::format("{{lat_deg = {}, lon_deg = {}, height_m = {}, above = \"ellipsoid\"}}, ",
                        at.lat_deg, at.lon_deg, at.height_m);
  }
  return fmt::format("kind = \"waypoints\"\nmax_climb_deg = 80.0\n{}waypoints = [{}]\n", keys,
                     list);
}

struct ClearanceOfPaths : testing::Test {
  SettledWorld settled;
  geo::WorldFrame frame{settled.store().manifest().origin};
  world::SurfaceFinder finder{settled.store(), settled.cut()};

  void prove(const geo::BodyMotion& motion, double least_m) {
    prove_clearance(motion, motion.trajectory->duration_s() - motion.start_s, least_m, finder,
                    settled.store());
  }
  std::string refusal(const geo::BodyMotion& motion, double least_m) {
    try {
      prove(motion, least_m);
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Input);
      return error.what();
    }
    ADD_FAILURE() << "nothing was refused";
    return "";
  }
};

TEST_F(ClearanceOfPaths, IsProvedWhereItHoldsAndRefusedWhereItDoesNot) {
  for (std::uint64_t path = 0; path < 3; ++path) {
    std::vector<Vector3d> places;
    for (std::uint64_t i = 0; i < 4; ++i) {
      const auto draw = [&](double from, double to, std::uint64_t k) {
        return core::random_between(from, to, kSeed, path, 3 * i + k);
      };
      const double x = draw(-70.0, 70.0, 0), y = draw(-70.0, 70.0, 1);
      places.emplace_back(x, y, SettledWorld::ground_m(x, y) + draw(22.0, 30.0, 2));
    }
    const geo::BodyMotion motion{motion_of(waypoints(places, frame), frame), 0.0};
    // All triangles, at places so close together that every place of the path is within 0.25 m of one.
    constexpr double kSpeed_mps = 10.0, kBetween_m = 0.5, kReach_m = 30.0;
    const double duration_s = motion.trajectory->duration_s();
    const int count = static_cast<int>(std::ceil(duration_s * kSpeed_mps / kBetween_m));
    double least_m = kReach_m, least_s = 0.0;
    for (int i = 0; i <= count; ++i) {
      const double time_s = duration_s * i / count;
      const Vector3d place = motion.at(time_s).world_from_body.translation;
      // What is farther than the least so far does not matter.
      const double here_m = settled.brute_distance_m(place, least_m);
      if (here_m < least_m) {
        least_m = here_m;
        least_s = time_s;
      }
    }
    SCOPED_TRACE(fmt::format("path {}: {} m at {} s", path, least_m, least_s));
    ASSERT_GT(least_m, 0.5);
    ASSERT_LT(least_m, kReach_m);
    EXPECT_NO_THROW(prove(motion, least_m - 0.5 * kBetween_m - 0.006));
    const std::string message = refusal(motion, least_m + 0.01);
    EXPECT_THAT(message, HasSubstr("nearer than clearance.min_m"));
    // Of several places that are too near it names the first, which need not be the nearest.
    const double said_m = std::strtod(message.c_str() + message.find("comes to ") + 9, nullptr);
    const double said_s = std::strtod(message.c_str() + message.find("t = ") + 4, nullptr);
    EXPECT_LT(said_m, least_m + 0.01);
    EXPECT_GT(said_m, least_m - 0.5 * kBetween_m - 0.001);
    EXPECT_NEAR(settled.brute_distance_m(motion.at(said_s).world_from_body.translation, kReach_m),
                said_m, 0.06);  // it says hundredths of a second
  }
}

TEST_F(ClearanceOfPaths, AThinMastBetweenTwoSamplesIsFound) {
  const double height_m = SettledWorld::ground_m(SettledWorld::kMastX_m, SettledWorld::kMastY_m) +
                          0.8 * SettledWorld::kMastHeight_m;
  const double beside_m = 1.0 + 0.5 * SettledWorld::kMastWidth_m;
  const auto at = [&](double along_m) {
    return Vector3d(SettledWorld::kMastX_m + along_m, SettledWorld::kMastY_m + beside_m, height_m);
  };
  const geo::BodyMotion motion{motion_of(waypoints({at(-12.5), at(0.0), at(12.5)}, frame), frame),
                               0.0};
  // A look every 5 m sees nothing within 2 m.
  for (double along_m = -12.5; along_m < 13.0; along_m += 5.0)
    EXPECT_GT(settled.brute_distance_m(at(along_m), 3.0), 2.0) << along_m;
  EXPECT_NO_THROW(prove(motion, 0.99));
  const std::string message = refusal(motion, 2.0);
  EXPECT_THAT(message, HasSubstr("comes to 1.00"));
  EXPECT_THAT(message, HasSubstr("object 1 of the layer masts (objects) at t = 1.2"));
  EXPECT_THAT(message, HasSubstr("lat 46.00"));
  // Farther, but by less than the proof's tolerance.
  EXPECT_THAT(refusal(motion, 0.998),
              HasSubstr("to be proved it must be 5 mm more than clearance.min_m = 0.998"));
  // A path that begins behind the mast does not pass it.
  EXPECT_NO_THROW(prove({motion.trajectory, 1.6}, 2.0));
}

TEST_F(ClearanceOfPaths, APathBelowTheGroundIsNotTakenForAClearOne) {
  const double ground_m = SettledWorld::ground_m(300.0, 300.0);
  const geo::BodyMotion motion{
      motion_of(
          waypoints({{300.0, 300.0, ground_m - 60.0}, {320.0, 300.0, ground_m - 60.0}}, frame),
          frame),
      0.0};
  EXPECT_THAT(refusal(motion, 3.0), HasSubstr("the path begins 60.0"));
}

/// The bounds cover a part of the motion; none is below the speed in its piece, nor higher by more than the factor.
void expect_bounds(const geo::Trajectory& motion) {
  const double from_s = 0.3, until_s = motion.duration_s() - 0.2;
  const std::vector<SpeedBound> bounds = speed_bounds(motion, from_s, until_s);
  ASSERT_FALSE(bounds.empty());
  double end_s = from_s;
  for (const SpeedBound& bound : bounds) {
    EXPECT_EQ(bound.begin_s, end_s);
    end_s = bound.end_s;
    double most_mps = 0.0;
    for (int i = 0; i <= 500; ++i) {
      const double time_s = bound.begin_s + (bound.end_s - bound.begin_s) * i / 500;
      most_mps = std::max(most_mps, motion.at(time_s).velocity_world_mps.norm());
    }
    EXPECT_LE(most_mps, bound.most_mps);
    EXPECT_GE(most_mps, bound.most_mps / 1.16);
  }
  EXPECT_EQ(end_s, until_s);
}

const geo::WorldFrame& frame_of_bounds() {
  static const geo::WorldFrame frame({.lat_deg = 46.0, .lon_deg = 8.0, .height_m = 0.0});
  return frame;
}

TEST(SpeedBounds, HoldForWaypoints) {
  expect_bounds(*motion_of(
      waypoints(
          {{0.0, 0.0, 300.0}, {150.0, 40.0, 320.0}, {180.0, 200.0, 310.0}, {0.0, 260.0, 330.0}},
          frame_of_bounds(), "speed_mps = 9.0\ncontinuity = \"fourth\"\n"),
      frame_of_bounds()));
}

TEST(SpeedBounds, HoldForAQuadrotor) {
  expect_bounds(*motion_of(
      "kind = \"quadrotor\"\nwaypoints = [{east_m = 0.0, north_m = 0.0, height_m = 100.0, above = "
      "\"ellipsoid\"}, {east_m = 60.0, north_m = 10.0, height_m = 120.0, above = \"ellipsoid\"}, "
      "{east_m = 70.0, north_m = 80.0, height_m = 100.0, above = \"ellipsoid\"}]\n[vehicle]\n"
      "mass_kg = 0.716\nthrust_n_s2_per_rad2 = 8.54858e-6\ndrag_n_s2_per_rad_m = 8.06428e-5\n"
      "max_rotor_radps = 838.0\n",
      frame_of_bounds()));
}

TEST(SpeedBounds, HoldForRecordedFlightsFarFromTheOrigin) {
  for (const geo::Continuity continuity : {geo::Continuity::Second, geo::Continuity::Fourth}) {
    const geo::RecordedMotion motion(frame_of_bounds(),
                                     geo::InterpolatingSpline({0.0, 4.0, 40.0, 47.0, 90.0},
                                                              {{-24e3, 18e3, 900.0},
                                                               {-23.9e3, 18.2e3, 905.0},
                                                               {-20e3, 19e3, 1400.0},
                                                               {-20.4e3, 19.5e3, 1390.0},
                                                               {-24e3, 24e3, 600.0}},
                                                              false, continuity),
                                     {.begin_s = 0.0, .end_s = 90.0}, std::nullopt,
                                     geo::Attitude{});
    expect_bounds(motion);
  }
}

}  // namespace
}  // namespace terracast::job
