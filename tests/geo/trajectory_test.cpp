#include "geo/trajectory.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/schema_writer.h"
#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using test::GroundWorld;
using test::kFourPlaces;
using test::message_of;
using test::options_from;
using test::orbit_text;
using test::trajectory_from;

TEST(TrajectoryOptionsTest, ContradictionsAreRefusedWithTheirPlace) {
  const auto refused = [](const std::string& text) {
    return message_of(core::ErrorKind::Config, [&] { options_from(text); });
  };
  EXPECT_NE(refused("name = \"P001\"").find("kind"), std::string::npos);
  EXPECT_NE(refused("kind = \"orbits\"").find("orbit"), std::string::npos);
  EXPECT_NE(refused("kind = \"orbit\"\nradius = 3.0").find("radius_m"), std::string::npos);
  EXPECT_NE(refused("kind = \"waypoints\"").find("0 waypoints"), std::string::npos);
  EXPECT_NE(refused("kind = \"waypoints\"\nwaypoints = [{ lat_deg = 1.0 }]").find("lon_deg"),
            std::string::npos);
  EXPECT_NE(
      refused("kind = \"waypoints\"\nwaypoints = [{ lat_deg = 1.0, lon_deg = 1.0, east_m = 1.0, "
              "north_m = 1.0 }]")
          .find("east_m"),
      std::string::npos);
  EXPECT_NE(
      refused("kind = \"waypoints\"\nwaypoints = [{ lat_deg = 95.0, lon_deg = 1.0 }]").find("-90"),
      std::string::npos);
  EXPECT_NE(refused("kind = \"orbit\"\nutc_start = \"noon\"").find("2025-06-21T10:00:00Z"),
            std::string::npos);
  EXPECT_NE(refused("kind = \"orbit\"\nname = \"../P\"").find("folder"), std::string::npos);
  EXPECT_NE(refused(std::string(kFourPlaces) + "laps = 2.0\n").find("closed"), std::string::npos);
}

TEST(TrajectoryOptionsTest, APlaceThatIsNotGivenIsRefusedWhenBuilding) {
  const GroundWorld world;
  const std::string message =
      message_of(core::ErrorKind::Config, [&] { trajectory_from("kind = \"orbit\"", world); });
  EXPECT_NE(message.find("centre"), std::string::npos) << message;
}

TEST(TrajectoryOptionsTest, TheSamePlaceTwiceIsRefused) {
  const GroundWorld world;
  const std::string message = message_of(core::ErrorKind::Config, [&] {
    trajectory_from(R"(
kind = "waypoints"
waypoints = [
  { east_m = 0.0, north_m = 0.0, height_m = 120.0 },
  { east_m = 0.0, north_m = 0.0, height_m = 120.0 },
]
)",
                    world);
  });
  EXPECT_NE(message.find("waypoint 1"), std::string::npos) << message;
}

TEST(TrajectoryOptionsTest, APathThatTurnsBackOnItselfIsRefused) {
  const GroundWorld world;
  const std::string message = message_of(core::ErrorKind::Config, [&] {
    trajectory_from(R"(
kind = "waypoints"
waypoints = [
  { east_m = 0.0, north_m = 0.0, height_m = 120.0 },
  { east_m = 900.0, north_m = 0.0, height_m = 120.0 },
  { east_m = 0.0, north_m = 0.0, height_m = 120.0 },
]
)",
                    world);
  });
  EXPECT_NE(message.find("turns back on itself at lat 42.4"), std::string::npos) << message;
}

TEST(TrajectoryOptionsTest, CopiesAreDeepAndChangeNothing) {
  const TrajectoryOptions first = options_from(kFourPlaces);
  TrajectoryOptions copy = first;
  EXPECT_EQ(core::toml_text(copy), core::toml_text(first));
  EXPECT_NE(&copy.kind_options(), &first.kind_options());
  copy = options_from(orbit_text(100.0, 10.0));
  EXPECT_NE(core::toml_text(copy), core::toml_text(first));
}

TEST(TrajectoryOptionsTest, TheManualShowsKeysWithoutAConfig) {
  bool has_waypoints = false;
  for (const core::KeyInfo& key : core::list_keys<TrajectoryOptions>()) {
    has_waypoints |= key.name.find("waypoints") != std::string::npos;
    EXPECT_FALSE(key.meaning.empty()) << key.name;
  }
  EXPECT_TRUE(has_waypoints);
}

TEST(SampleFrames, AreTakenAtTheRateFromTheStartOn) {
  const GroundWorld world;
  const TrajectoryOptions options =
      options_from(std::string("rate_hz = 4.0\nnum_frames = 10\nstart_s = 3.0\n") + kFourPlaces);
  const std::vector<BodyState> states = sample_frames(options, world.context()).states;
  ASSERT_EQ(states.size(), 10u);
  const auto motion = options.kind_options().build(world.context());
  for (std::size_t i = 0; i < states.size(); ++i) {
    EXPECT_EQ(states[i].time_s, static_cast<double>(i) / 4.0);
    EXPECT_EQ(states[i].world_from_body,
              motion->at(3.0 + static_cast<double>(i) / 4.0).world_from_body);
  }
}

TEST(SampleFrames, FillTheMotionAndRefuseMore) {
  const GroundWorld world;
  const std::string line = R"(
kind = "waypoints"
rate_hz = 10.0
speed_mps = 10.0
waypoints = [
  { east_m = 0.0, north_m = 0.0, height_m = 100.0 },
  { east_m = 0.0, north_m = 100.0, height_m = 100.0 },
]
)";
  // 100 m at the height of 100 m above the origin's plane: 10 s, 101 frames with both ends.
  EXPECT_EQ(sample_frames(options_from(line), world.context()).states.size(), 101u);
  const std::string message = message_of(core::ErrorKind::Config, [&] {
    sample_frames(options_from("num_frames = 102\n" + line), world.context());
  });
  EXPECT_NE(message.find("holds 101"), std::string::npos) << message;
  EXPECT_NE(message.find("trajectory P000"), std::string::npos) << message;
  message_of(core::ErrorKind::Config,
             [&] { sample_frames(options_from("start_s = 11.0\n" + line), world.context()); });
}

}  // namespace
}  // namespace terracast::geo
