#include "validate/readers/sensors.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "core/error.h"
#include "tests/support/test_data.h"
#include "validate/oracle_view.h"

/// sensors.json and samples, written here.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

/// What is read of one sensor.
SensorRecord read_one(const std::string& kind, const std::string& channels,
                      const std::string& samples) {
  const test::ScratchFolder folder;
  const fs::path root = folder.path();
  const std::string mount = R"({"quaternion_wxyz": [1, 0, 0, 0], "translation_m": [0, 0, 0]})";
  test::write_text(root / "P000/sensors.json",
                   fmt::format(R"({{"frames": "body, rig and sensor: x forward, y left, z up",
"sensors": [{{"rig": "rig", "name": "one", "kind": "{}", "file": "sensors/rig/one.csv",
"rate_hz": 10, "channels": {}, "body_from_sensor": {}, "rig_from_sensor": {},
"settings_toml": "least_range_m = 0.1\nmost_range_m = 2000.0\n"}}]}})",
                               kind, channels, mount, mount));
  test::write_text(root / "P000/sensors/rig/one.csv", samples);
  Dataset dataset;
  dataset.root = root;
  dataset.files["P000/sensors.json"] = {};
  dataset.files["P000/sensors/rig/one.csv"] = {};
  Sequence sequence;
  sequence.path = "P000";
  return read_sensors(dataset, sequence).at(0);
}

TEST(Sensors, ChannelsOfPlugInsAreCalledWhatTheyLike) {
  const SensorRecord sensor =
      read_one("mine.accelerometer",
               R"([{"name": "forward", "unit": "m/s^2"}, {"name": "count", "unit": ""}])",
               "time_s,forward,count\n0,-inf,3\n0.1,inf,4\n");
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(sensor.values, (std::vector<double>{-kInfinity, 3.0, kInfinity, 4.0}));
}

TEST(Sensors, ARangefinderHasItsOneChannel) {
  const std::string range = R"({"name": "range_m", "unit": "m"})";
  EXPECT_EQ(read_one("rangefinder", "[" + range + "]", "time_s,range_m\n0,7\n").values.size(), 1U);
  for (const std::string& channels : {std::string("[]"), "[" + range + ", " + range + "]",
                                      std::string(R"([{"name": "range_m", "unit": "km"}])"),
                                      std::string(R"([{"name": "reach_m", "unit": "m"}])")})
    EXPECT_THROW(read_one("rangefinder", channels, "time_s\n0\n"), core::Error) << channels;
}

TEST(Sensors, ChannelsOfOurKindsAreTheirOwn) {
  const std::string ranges =
      R"([{"name": "range_m", "unit": "m"}, {"name": "true_range_m", "unit": "m"}])";
  EXPECT_EQ(
      read_one("radar_altimeter", ranges, "time_s,range_m,true_range_m\n0,inf,7\n").values.size(),
      2U);
  const std::string field = R"([{"name": "field_x_nt", "unit": "nT"}])";
  EXPECT_THROW(read_one("magnetometer", field, "time_s,field_x_nt\n0,1\n"), core::Error);
  EXPECT_THROW(read_one("compass", field, "time_s,field_x_nt\n0,1\n"), core::Error);
}

// Places of single images are those of georeference.csv: micrometres of height.
TEST(Sensors, PlacesOfGeoreferencesAreRounded) {
  for (const char* format : {"coco", "kitti_object", "kitti", "kitti_raw"}) {
    EXPECT_GE(pose_rounding(format, 0.0).position_m, 0.5e-6 + 2.0 * 0.56e-8) << format;
    EXPECT_LT(pose_rounding(format, 0.0).position_m, 0.6e-6) << format;
  }
  EXPECT_LT(pose_rounding("terracast", 0.0).position_m, 1e-7);
}

}  // namespace
}  // namespace terracast::validate
