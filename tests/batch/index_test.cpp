#include "batch/dataset/index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "core/error.h"
#include "tests/batch/plane_capture.h"
#include "tests/batch/sample_facts.h"
#include "tests/support/test_data.h"

namespace terracast::batch {
namespace {

using testing::ElementsAre;

std::vector<core::Json> lines_of(const std::string& text) {
  std::vector<core::Json> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(core::Json::parse(line, "index.jsonl"));
  return lines;
}

TEST(Index, HasALineForEachSequenceById) {
  DatasetFacts facts = sample_facts();
  const std::string text = index_lines(facts.sequences);
  const std::vector<core::Json> lines = lines_of(text);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].at("id").string(), "run0/north");
  EXPECT_EQ(lines[1].at("id").string(), "run0/south");
  EXPECT_THAT(lines[1].at("swept").string(), testing::StartsWith("world.name = \""));
  EXPECT_EQ(lines[2].at("id").string(), "run1/coast");
  EXPECT_EQ(lines[1].at("split").string(), "test");
  EXPECT_THAT(lines[1].at("formats").strings(), ElementsAre("colmap", "kitti"));
  EXPECT_THAT(lines[1].at("folders").strings(), ElementsAre("colmap/run0", "kitti/run0"));
  EXPECT_EQ(lines[2].at("frames").integer(), 400);
  EXPECT_EQ(lines[2].at("lon_deg").number(), -179.99);
  EXPECT_EQ(lines[2].at("track_length_m").number(), 1500.5);
  std::reverse(facts.sequences.begin(), facts.sequences.end());
  EXPECT_EQ(index_lines(facts.sequences), text);
}

TEST(Index, SplitsListTheirSequences) {
  const DatasetFacts facts = sample_facts();
  EXPECT_EQ(split_lines(facts.sequences, Split::Train), "run0/north\n");
  EXPECT_EQ(split_lines(facts.sequences, Split::Val), "run1/coast\n");
  EXPECT_EQ(split_lines(facts.sequences, Split::Test), "run0/south\n");
}

TEST(SequenceFacts, AreThoseOfTheFlight) {
  PlaneCapture plane;
  plane.origin = {.lat_deg = -16.9, .lon_deg = 179.9999, .height_m = 0.0};
  plane.world_from_camera = {looking({0.0, 0.0, 900.0}, 0.0, 90.0),
                             looking({30.0, 40.0, 900.0}, 0.0, 90.0),
                             looking({30.0, 40.0, 1020.0}, 0.0, 90.0)};
  const test::ScratchFolder folder;
  const SequenceFacts facts = sequence_facts("run7", plane.write(folder / "capture"));
  EXPECT_EQ(facts.id(), "run7/valley");
  EXPECT_EQ(facts.num_frames, 3);
  EXPECT_EQ(facts.num_cameras, 1);
  EXPECT_EQ(facts.num_images(), 3);
  EXPECT_EQ(facts.duration_s, 0.2);
  EXPECT_NEAR(facts.track_length_m, 50.0 + 120.0, 1e-6);
  // The camera is mounted less than half a metre from the body's reference point: 5e-6 degrees.
  EXPECT_NEAR(facts.lat_deg, -16.9, 5e-6);
  EXPECT_NEAR(facts.lon_deg, 179.9999, 5e-6);
  EXPECT_EQ(facts.south_deg, facts.lat_deg);
  EXPECT_NEAR(facts.north_deg, -16.9 + 40.0 / 110660.0, 1e-5);
  // 30 m east are 0.00028 degrees there: across the meridian.
  EXPECT_EQ(facts.west_deg, facts.lon_deg);
  EXPECT_NEAR(facts.east_deg, -180.0 + 0.00018, 1e-5);
  EXPECT_NEAR(facts.lowest_m, 900.0, 0.5);
  EXPECT_NEAR(facts.highest_m - facts.lowest_m, 120.0, 1e-3);
}

TEST(CameraFacts, AreThoseOfTheCapture) {
  const std::vector<CameraFacts> cameras =
      camera_facts(test::tiny_sequence({.has_mcs4 = false, .has_tartan_v1 = true}));
  ASSERT_EQ(cameras.size(), 4U);
  EXPECT_EQ(cameras[0], (CameraFacts{"tartan2", "lcam_front", "pinhole", 640, 640, 320.0, 320.0}));
  EXPECT_EQ(cameras[3], (CameraFacts{"tartan_v1", "right", "pinhole", 640, 480, 320.0, 320.0}));
}

TEST(FileGroups, AreTheFilesOfTheFormatsByTheirEnding) {
  const std::vector<FileGroup> groups = group_files(sample_facts());
  ASSERT_EQ(groups.size(), 5U);  // splits and plots are folders of no format
  EXPECT_EQ(groups[0].format + " " + groups[0].extension, "colmap bin");
  EXPECT_EQ(groups[1].format + " " + groups[1].extension, "colmap json");
  EXPECT_EQ(groups[2].format + " " + groups[2].extension, "colmap png");
  EXPECT_EQ(groups[2].num_files, 8);
  EXPECT_EQ(groups[2].num_bytes, 8000000U);
}

TEST(Publication, IsCheckedBeforeItIsUsed) {
  const auto is_refused = [](const Publication& publication) {
    try {
      publication.validate();
    } catch (const core::Error& error) {
      return error.kind() == core::ErrorKind::Config;
    }
    return false;
  };
  EXPECT_FALSE(is_refused({}));
  EXPECT_FALSE(is_refused(sample_facts().publication));
  EXPECT_TRUE(is_refused({.name = ""}));
  EXPECT_TRUE(is_refused({.version = "1.0"}));
  EXPECT_TRUE(is_refused({.version = "v1.0.0"}));
  EXPECT_TRUE(is_refused({.date_published = "21.6.2025"}));
  EXPECT_TRUE(is_refused({.date_published = "2025-13-01"}));
}

}  // namespace
}  // namespace terracast::batch
