#include "job/moving.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "capture/frame.h"
#include "core/atomic_file.h"
#include "core/toml_reader.h"
#include "sensors/moving_record.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "tiler/objects/things.h"

namespace terracast::job {
namespace {

using Eigen::Vector3d;

/// Flat land at 46 N 7 E.
struct Land {
  geo::WorldFrame frame{geo::Geodetic{.lat_deg = 46.0, .lon_deg = 7.0, .height_m = 0.0}};
  geo::TrajectoryContext context(double rate_hz) const {
    return {.frame = frame,
            .ground_height_m = [](double, double) { return 0.0; },
            .geoid = nullptr,
            .rate_hz = rate_hz,
            .half_size_m = 2000.0};
  }
};

template <class Options>
Options read(const std::string& text) {
  Options options;
  core::TomlDocument::parse(text, "moving.toml").read(options);
  return options;
}

/// A circle of 100 m at 10 m/s: it lasts 20 pi seconds.
MovingOptions circle(const std::string& keys) {
  return read<MovingOptions>(
      "name = \"car\"\nthing = \"hatchback\"\nkind = \"orbit\"\nradius_m = 100.0\nspeed_mps = "
      "10.0\n"
      "centre = {east_m = 0.0, north_m = 0.0}\n" +
      keys);
}

geo::TrajectoryOptions flight(const std::string& name, const std::string& keys) {
  return read<geo::TrajectoryOptions>("name = \"" + name +
                                      "\"\nkind = \"orbit\"\nradius_m = 100.0\nspeed_mps = 10.0\n"
                                      "centre = {east_m = 0.0, north_m = 0.0, height_m = 50.0}\n" +
                                      keys);
}

std::vector<geo::BodyState> frames_at(double rate_hz, int count) {
  std::vector<geo::BodyState> frames(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) frames[static_cast<std::size_t>(i)].time_s = i / rate_hz;
  return frames;
}

TEST(LaidOutMoving, IsThereWhileItsMotionLastsAndRollsAsFarAsItGoes) {
  const Land land;
  const auto things = [&](const std::string& keys) {
    return lay_out_moving(std::vector{circle(keys)}, {}, flight("P000", ""), frames_at(0.5, 80),
                          land.context(0.5))
        .at(0);
  };
  // The motion lasts 62.8 s of the 158 s of the sequence.
  const scene::MovingThing once = things("");
  EXPECT_EQ(once.ride, scene::Ride::Ground);
  EXPECT_EQ(once.parts.size(), 4U);
  for (std::size_t i = 0; i < 80; ++i) EXPECT_EQ(once.states[i].has_value(), i < 32) << i;
  for (std::size_t i = 0; i < 32; ++i) {
    EXPECT_NEAR(once.gone_m[i], 20.0 * static_cast<double>(i), 1e-3);
    EXPECT_EQ(once.states[i]->time_s, 2.0 * static_cast<double>(i));
  }
  // It comes 11 s late.
  const scene::MovingThing late = things("start_s = -11.0\n");
  for (std::size_t i = 0; i < 80; ++i)
    EXPECT_EQ(late.states[i].has_value(), i >= 6 && i <= 36) << i;
  // Again and again, but not before it begins.
  const scene::MovingThing again = things("start_s = -11.0\nrepeat = true\n");
  for (std::size_t i = 0; i < 80; ++i) EXPECT_EQ(again.states[i].has_value(), i >= 6) << i;
  const double angle_rad = (2.0 * 79 - 11.0) * 10.0 / 100.0;
  const auto azimuth = [](const geo::BodyState& state) {
    return std::atan2(state.world_from_body.translation.y(), state.world_from_body.translation.x());
  };
  EXPECT_NEAR(std::remainder(azimuth(*again.states[79]) - azimuth(*once.states[0]) - angle_rad,
                             2.0 * std::numbers::pi),
              0.0, 1e-3);
}

TEST(LaidOutMoving, OtherFlightsAreSeenAtTheSameTimeByTheirMiddle) {
  const Land land;
  const std::vector<geo::TrajectoryOptions> flights = {
      flight("a", "rate_hz = 2.0\n"),
      flight("b", "rate_hz = 10.0\nshown_as = \"helicopter\"\nstart_s = 3.0\n"),
      flight("c", "shown_as = \"quadcopter\"\n")};
  const std::vector<double> half_sizes(3, 2000.0);
  const auto seen_by = [&](std::size_t flight) {
    return lay_out_moving({}, {flights, half_sizes}, flights[flight], frames_at(2.0, 9),
                          land.context(2.0));
  };
  EXPECT_EQ(seen_by(0).size(), 2U);
  EXPECT_EQ(seen_by(1).size(), 1U);
  EXPECT_EQ(seen_by(1)[0].name, "c");
  const scene::MovingThing helicopter = seen_by(0)[0];
  // Its own frames say where the body is; what is drawn stands half its height lower along its own up.
  const geo::SampledFrames own = geo::sample_frames(flights[1], land.context(10.0));
  for (std::size_t i = 0; i < 9; ++i) {
    const geo::BodyState& body = own.states[5 * i];
    ASSERT_TRUE(helicopter.states[i]);
    EXPECT_LT((helicopter.states[i]->world_from_body * Vector3d(0.0, 0.0, 0.5 * 3.34) -
               body.world_from_body.translation)
                  .norm(),
              1e-9);
    EXPECT_LT(helicopter.states[i]->world_from_body.rotation.angularDistance(
                  body.world_from_body.rotation),
              1e-9);
  }
  // Parts of one recording do not meet themselves.
  std::vector<geo::TrajectoryOptions> parts = {flights[1], flights[1], flights[2]};
  parts[0].name = "b_0";
  parts[1].name = "b_1";
  parts[0].split_from = parts[1].split_from = "b";
  EXPECT_EQ(lay_out_moving({}, {parts, half_sizes}, parts[0], frames_at(2.0, 3), land.context(2.0))
                .size(),
            1U);
}

// The foot of a body that rolls into its turns swings about the body's middle.
TEST(LaidOutMoving, TheFootOfABodyAcceleratesAsItsPlacesDo) {
  const Land land;
  const std::vector<geo::TrajectoryOptions> flights = {
      flight("a", ""),
      read<geo::TrajectoryOptions>(
          "name = \"b\"\nshown_as = \"helicopter\"\nkind = \"waypoints\"\nspeed_mps = 40.0\n"
          "waypoints = [{east_m = -300.0, north_m = 0.0, height_m = 50.0}, "
          "{east_m = -100.0, north_m = 60.0, height_m = 60.0}, "
          "{east_m = 100.0, north_m = -60.0, height_m = 50.0}, "
          "{east_m = 300.0, north_m = 0.0, height_m = 60.0}]\n")};
  const std::vector<double> half_sizes(2, 2000.0);
  constexpr double kRate_hz = 100.0;
  const scene::MovingThing helicopter =
      lay_out_moving({}, {flights, half_sizes}, flights[0], frames_at(kRate_hz, 1400),
                     land.context(kRate_hz))
          .at(0);
  const Vector3d arm(0.0, 0.0, -0.5 * 3.34);
  std::vector<double> errors_mps2;
  double largest_twist_mps2 = 0.0;
  for (std::size_t i = 2; i + 2 < helicopter.states.size() && helicopter.states[i + 2]; ++i) {
    const auto at = [&](std::size_t k) -> Vector3d {
      return helicopter.states[k]->world_from_body.translation;
    };
    const Vector3d second = (16.0 * (at(i + 1) + at(i - 1)) - at(i + 2) - at(i - 2) - 30.0 * at(i)) *
                            (kRate_hz * kRate_hz / 12.0);
    const geo::BodyState& state = *helicopter.states[i];
    errors_mps2.push_back((state.acceleration_world_mps2 - second).norm());
    largest_twist_mps2 = std::max(
        largest_twist_mps2, (2.0 * state.terms.turning_body[0]).cross(arm).norm());
  }
  // Across knots, where the jerk jumps by some 10 m/s^3, differences over 10 ms are off.
  std::sort(errors_mps2.begin(), errors_mps2.end());
  EXPECT_LT(errors_mps2[errors_mps2.size() * 3 / 4], 1e-4);
  EXPECT_LT(errors_mps2.back(), 0.15);
  EXPECT_GT(largest_twist_mps2, 0.2);
}

// What a body carries says how near to the world's edge it stays, and so which part of a recording is flown: the others
// see it where its own sequence has it.
TEST(LaidOutMoving, ABodyIsSeenWhereItsOwnRigsLetItBe) {
  const Land land;
  const test::ScratchFolder folder;
  std::string track = "time_s,x,y,z\n";
  for (int t = 0; t <= 40; ++t) track += fmt::format("{},{},0,30\n", t, 10 * t - 200);
  core::write_file(folder / "track.csv", track);
  const std::vector<geo::TrajectoryOptions> flights = {
      flight("a", ""), read<geo::TrajectoryOptions>(fmt::format(
                           "name = \"b\"\nshown_as = \"helicopter\"\nkind = \"recorded\"\n"
                           "file = \"{}\"\nformat = \"csv\"\nframe = \"local\"\n"
                           "place_columns = [\"x\", \"y\", \"z\"]\noutside = \"clip\"\n"
                           "origin = {{lat_deg = 46.0, lon_deg = 7.0, height_m = 0.0}}\n",
                           (folder / "track.csv").string()))};
  const std::vector<double> half_sizes = {2000.0, 101.0};
  const std::vector<scene::MovingThing> things =
      lay_out_moving({}, {flights, half_sizes}, flights[0], frames_at(1.0, 40), land.context(1.0));
  ASSERT_EQ(things.size(), 1U);
  // It begins at the first place that is looked at inside, every 5 m; from there it goes 10 m/s to the last.
  for (std::size_t i = 0; i < 40; ++i) {
    ASSERT_EQ(things[0].states[i].has_value(), i <= 20) << i;
    if (things[0].states[i]) {
      EXPECT_NEAR(things[0].states[i]->world_from_body.translation.x(),
                  10.0 * static_cast<double>(i) - 100.0, 1e-3);
    }
  }
}

TEST(LaidOutMoving, WheelsTurnWhereTheyRoll) {
  const Land land;
  const auto turning = [&](const std::string& thing, const std::string& keys) {
    MovingOptions options = circle(keys);
    options.thing = thing;
    double most = 0.0;
    for (const scene::TurningPart& part :
         lay_out_moving(std::vector{options}, {}, flight("P000", ""), frames_at(1.0, 2),
                        land.context(1.0))
             .at(0)
             .parts)
      most = std::max(most, std::abs(part.per_metre_rad));
    return most;
  };
  EXPECT_EQ(turning("light_aircraft", ""), 0.0);  // it flies
  EXPECT_GT(turning("light_aircraft", "ride = \"ground\"\n"), 1.0);
  EXPECT_GT(turning("hatchback", ""), 1.0);
  EXPECT_GT(turning("hatchback", "ride = \"free\"\n"), 1.0);
}

TEST(LaidOutMoving, WhatDoesNotMoveIsRefused) {
  test::expect_error(core::ErrorKind::Config,
                     {"a lighthouse is not a thing that moves", "hatchback", "ferry", "person"},
                     [] {
                       read<MovingOptions>(
                           "name = \"a\"\nthing = \"lighthouse\"\nkind = \"orbit\"\nradius_m = "
                           "100.0\nspeed_mps = 1.0\ncentre = {east_m = 0.0, north_m = 0.0}\n");
                     });
  test::expect_error(core::ErrorKind::Config, {"wood_pole", "trajectory a"}, [] {
    check_moving({}, std::vector{flight("a", "shown_as = \"wood_pole\"\n")});
  });
}

TEST(LaidOutMoving, NamesOfPartsMustFitToo) {
  const Land land;
  MovingOptions wheel = circle("");
  wheel.name = "car-wheel1";
  test::expect_error(core::ErrorKind::Config, {"\"car-wheel1\" of what moves is there twice"}, [&] {
    lay_out_moving(std::vector{circle(""), wheel}, {}, flight("P000", ""), frames_at(1.0, 2),
                   land.context(1.0));
  });
}

TEST(CapturedThings, AreThoseThatWereLaidOut) {
  const Land land;
  MovingOptions drone = circle("");
  drone.name = "drone";
  drone.thing = "quadcopter";
  drone.variant = 2;
  const std::vector<scene::MovingThing> laid_out = lay_out_moving(
      std::vector{circle(""), drone}, {}, flight("P000", ""), frames_at(1.0, 2), land.context(1.0));
  capture::SequenceInfo info;
  info.moving = sensors::describe_moving(laid_out);
  const std::vector<scene::MovingThing> captured = captured_things(info);
  EXPECT_EQ(sensors::describe_moving(captured), info.moving);
  ASSERT_EQ(captured.size(), 2U);
  EXPECT_EQ(captured[1].parts.size(), 4U);
  info.moving[0].thing = "zeppelin";
  test::expect_error(core::ErrorKind::Input, {"zeppelin", "render it again"},
                     [&] { captured_things(info); });
}

TEST(CapturedThings, OfOneKindShareTheirShapes) {
  capture::SequenceInfo info;
  std::vector<scene::MovingThing> things;
  for (const char* name : {"first", "second"})
    things.push_back(moving_thing(name, thing_called("hatchback"), 0));
  things.push_back(moving_thing("drone", thing_called("quadcopter"), 0));
  info.moving = sensors::describe_moving(things);
  const std::vector<scene::MovingThing> captured = captured_things(info);
  EXPECT_EQ(sensors::describe_moving(captured), info.moving);
  ASSERT_EQ(captured.size(), 3U);
  EXPECT_EQ(captured[0].shape.shown, captured[1].shape.shown);
  EXPECT_NE(captured[0].shape.shown, captured[2].shape.shown);
  ASSERT_EQ(captured[0].parts.size(), captured[1].parts.size());
  ASSERT_FALSE(captured[0].parts.empty());
  for (std::size_t i = 0; i < captured[0].parts.size(); ++i)
    EXPECT_EQ(captured[0].parts[i].shape.shown, captured[1].parts[i].shape.shown);
}

TEST(LaidOutMoving, ColoursOfAThingHaveShapesOfTheirOwn) {
  MovingThings things;
  const tiler::ThingInfo& car = thing_called("hatchback");
  const scene::MovingThing first = things.of("first", car, 0), second = things.of("second", car, 1),
                           third = things.of("third", car, 1);
  EXPECT_NE(first.shape.shown, second.shape.shown);
  EXPECT_EQ(second.shape.shown, third.shape.shown);
  EXPECT_EQ(third.name, "third");
  EXPECT_EQ(third.variety, 1);
  EXPECT_EQ(scene::text_of_shapes(std::array{third}),
            scene::text_of_shapes(std::array{moving_thing("third", car, 1)}));
}

// A capture does not say which variant a thing is of, and labels take the first.
TEST(CapturedThings, VariantsDifferInColourAlone) {
  for (const tiler::ThingInfo& info : tiler::all_things()) {
    SCOPED_TRACE(info.name);
    const tiler::MovableThing first = tiler::movable_thing(info, 0);
    for (int variant = 1; variant < info.num_variants; ++variant) {
      const tiler::MovableThing other = tiler::movable_thing(info, variant);
      EXPECT_TRUE(other.shape.vertices_steps == first.shape.vertices_steps);
      ASSERT_EQ(other.shape.triangles.size(), first.shape.triangles.size());
      for (std::size_t i = 0; i < first.shape.triangles.size(); ++i)
        ASSERT_EQ(other.shape.triangles[i].corners, first.shape.triangles[i].corners);
      ASSERT_EQ(other.turning.size(), first.turning.size());
      for (std::size_t i = 0; i < first.turning.size(); ++i) {
        EXPECT_TRUE(other.turning[i].shape.vertices_steps == first.turning[i].shape.vertices_steps);
        EXPECT_EQ(other.turning[i].turning.origin_m, first.turning[i].turning.origin_m);
      }
    }
  }
}

}  // namespace
}  // namespace terracast::job
