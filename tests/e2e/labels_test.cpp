// Labels by the program: `run` makes what formats need; stage by stage the same bytes come out.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/atomic_file.h"
#include "core/instance_id.h"
#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;

/// The tiny job low over trees, in COCO.
std::string wooded_job() {
  std::string text = replaced(tiny_job_text(), "height_m = 250.0", "height_m = 150.0");
  text = replaced(text, "format = \"colmap\"", "format = \"coco\"\ncategories = \"own\"");
  return replaced(
      text, "[detail]\n",
      "[[world.layer]]\nname = \"cover\"\nkind = \"land_cover\"\nsource = \"derived\"\n\n"
      "[[world.layer]]\nname = \"trees\"\nkind = \"vegetation\"\n\n[detail]\n");
}

TEST(Labels, StageByStageTheyAreThoseOfRun) {
  const ScratchFolder folder;
  const std::string job = write_text(folder / "job.toml", wooded_job()).string();
  const std::string out = (folder / "out").string(), again = (folder / "again").string();
  const ProgramResult run = run_program({"run", job, "--out", out});
  ASSERT_EQ(run.status, 0) << run.output;
  EXPECT_THAT(run.output, testing::HasSubstr("label"));
  EXPECT_TRUE(fs::exists(folder / "out/capture/P000/labels/objects/objects.json"));

  const std::string world = (folder / "out/world").string();
  ASSERT_EQ(run_program({"render", job, "--out", again, "--world", world}).status, 0);
  // Before they are labelled objects have no boxes.
  const ProgramResult unlabelled = run_program({"export", job, "--out", again});
  EXPECT_EQ(unlabelled.status, 3) << unlabelled.output;
  EXPECT_THAT(unlabelled.output, testing::HasSubstr("terracast label"));
  const ProgramResult label =
      run_program({"label", job, "--out", again, "--world", world, "--threads", "1"});
  ASSERT_EQ(label.status, 0) << label.output;
  ASSERT_EQ(run_program({"export", job, "--out", again}).status, 0);
  for (const char* part : {"capture", "export"})
    EXPECT_EQ(first_difference(folder / "out" / part, folder / "again" / part), "") << part;
}

/// Things that fly ahead of the cameras, one that climbs among them, and labels of all kinds.
std::string moving_job() {
  std::string text = replaced(tiny_job_text(), "format = \"colmap\"\n", R"(format = "coco"
categories = "own"

[[exports]]
format = "kitti_object"
rig = "pair"
camera = "left"

[[labels]]
kind = "cloud"
voxel_m = 4.0

[[labels]]
kind = "covisibility"

[[labels]]
kind = "pairs"
frames_apart = [0, 1, 2]
cameras = ["pair/left pair/right", "P000/pair/left P001/pair/right"]

[[labels]]
kind = "tracks"
num_points = 300

[[labels]]
kind = "volume"
voxel_m = 4.0
reach_m = 400.0

[[trajectories]]
name = "P001"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 247.0, above = "ground"}
radius_m = 300.0
speed_mps = 30.0
start_azimuth_deg = 84.0
rate_hz = 1.0
num_frames = 2
shown_as = "helicopter"

[[moving]]
name = "car"
thing = "hatchback"
ride = "free"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 244.0, above = "ground"}
radius_m = 301.0
speed_mps = 30.5
start_azimuth_deg = 87.0

[[moving]]
name = "walker"
thing = "person"
ride = "free"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 247.0, above = "ground"}
radius_m = 302.0
speed_mps = 30.0
start_azimuth_deg = 88.2

[[moving]]
name = "climber"
thing = "box_truck"
ride = "free"
kind = "waypoints"
speed_mps = 30.0
waypoints = [{east_m = 299.0, north_m = 20.0, height_m = 230.0, above = "ground"}, {east_m = 280.0, north_m = 110.0, height_m = 265.0, above = "ground"}]
)");
  text = replaced(text, "name = \"P000\"\nkind = \"orbit\"\n",
                  "name = \"P000\"\nkind = \"orbit\"\nstart_azimuth_deg = 90.0\n");
  text = replaced(text, "num_frames = 4", "num_frames = 3");
  text = replaced(text, "name = \"tiny\"\n\n", "name = \"tiny\"\nshared_geometry = true\n\n");
  return replaced(text, "mount_pitch_deg = 40.0", "mount_pitch_deg = 15.0");
}

// Every check of both formats holds, and each of the things is in all of them.
TEST(Labels, AreMadeWhereThingsMove) {
  const ScratchFolder folder;
  const std::string job = write_text(folder / "job.toml", moving_job()).string();
  const ProgramResult run = run_program({"run", job, "--out", (folder / "out").string()});
  ASSERT_EQ(run.status, 0) << run.output;
  // Of frames apart that the shorter sequence has not it tells once, before it begins.
  const std::string told = "frames_apart = 2: sequence ";
  std::size_t num_told = 0;
  for (auto at = run.output.find(told); at != std::string::npos;
       at = run.output.find(told, at + 1)) {
    EXPECT_LT(at, run.output.find("label:"));
    ++num_told;
  }
  EXPECT_EQ(num_told, 2U) << run.output;  // P001 by itself, and P000 with it
  const fs::path labels = folder / "out/capture/P000/labels";
  const std::string objects = core::read_text_file(labels / "objects/objects.json");
  for (const char* name : {"car", "walker", "climber", "P001"})
    EXPECT_THAT(objects, testing::HasSubstr(fmt::format("\"moving\": \"{}\"", name)));
  for (const char* file : {"cloud/cloud.ply", "covisibility/covisibility.csv", "volume/volume.vdb",
                           "tracks/points.npz", "tracks/pair/left.npz", "tracks/tracks.json",
                           "pairs/pair/left/pair/right/000000_000001.exr",
                           "pairs/pair/left/P001/pair/right/000000_000001.exr"})
    EXPECT_TRUE(fs::exists(labels / file)) << file;
  // All sequences show the same tiles.
  const auto tiles_of = [&](const char* sequence) {
    const core::Json json = core::Json::read(folder / "out/capture" / sequence / "sequence.json");
    return json.at("geometry").at("tiles").text();
  };
  EXPECT_EQ(tiles_of("P000"), tiles_of("P001"));
  EXPECT_GT(core::Json::read(labels / "volume/volume.json").at("rays_on_what_moves").integer(), 50);

  const fs::path kitti = folder / "out/export/kitti_object/training/label_2";
  std::string rows;
  for (const auto& entry : fs::directory_iterator(kitti)) rows += core::read_text_file(entry);
  for (const char* type : {"Car ", "Pedestrian ", "Truck ", "Misc "})
    EXPECT_THAT(rows, testing::HasSubstr(type));
  const core::Json coco = core::Json::read(folder / "out/export/coco/annotations/instances.json");
  std::set<std::int64_t> ids;
  for (std::size_t i = 0; i < coco.at("annotations").size(); ++i)
    ids.insert(coco.at("annotations").at(i).at("instance_id").integer());
  EXPECT_GE(std::distance(ids.lower_bound(std::int64_t{core::kFirstMovingId}), ids.end()), 4);

  // Made again by the command alone, of one thread, they are the same.
  fs::rename(labels, folder / "before");
  const ProgramResult label =
      run_program({"label", job, "--out", (folder / "out").string(), "--threads", "1"});
  ASSERT_EQ(label.status, 0) << label.output;
  EXPECT_EQ(first_difference(folder / "before", labels), "");
}

// Before anything is made.
TEST(Labels, PairsOfSequencesThatCannotBeAreRefused) {
  const ScratchFolder folder;
  const auto refused = [&](const std::string& what, const std::string& by, const char* message) {
    const std::string job =
        write_text(folder / "job.toml", replaced(moving_job(), what, by)).string();
    const ProgramResult run = run_program({"run", job, "--out", (folder / "out").string()});
    EXPECT_EQ(run.status, 2) << run.output;
    EXPECT_THAT(run.output, testing::HasSubstr(message));
    EXPECT_FALSE(fs::exists(folder / "out/world"));
  };
  refused("shared_geometry = true\n", "", "need shared_geometry = true");
  refused("P001/pair/right", "P002/pair/right", "unknown sequence \"P002\"");
  refused("P001/pair/right", "P001/pear/right", "unknown camera \"pear/right\"");
}

TEST(Labels, WhatIsNotAskedForIsNotMade) {
  const ScratchFolder folder;
  const std::string job = write_text(folder / "job.toml", tiny_job_text()).string();
  const ProgramResult nothing = run_program({"label", job, "--out", (folder / "out").string()});
  EXPECT_EQ(nothing.status, 2) << nothing.output;
  EXPECT_THAT(nothing.output, testing::HasSubstr("--what"));
  const ProgramResult unknown =
      run_program({"label", job, "--out", (folder / "out").string(), "--what", "cloudz"});
  EXPECT_EQ(unknown.status, 2) << unknown.output;
}

}  // namespace
}  // namespace terracast::test
