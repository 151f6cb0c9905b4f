// Vehicles that carry rigs of their own: which, with what errors, and what their sequences' captures say of them.

#include "job/carried_rigs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/log.h"
#include "core/toml_reader.h"
#include "job/job.h"
#include "render/checked_plan.h"
#include "render/input_hash.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "world/lod.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using test::replaced;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// The tiny job, in whose rig `pair` nothing errs, with a second rig that has errors and images of its own, and a second
/// flight that carries that alone.
/// more   keys of the second trajectory
std::string fleet_text(const std::string& more = "rigs = [\"eye\"]\n") {
  const std::string text = test::tiny_job_text(R"([[rigs]]
name = "eye"

[rigs.errors]
azimuth_sd_deg = 0.2
offset_sd_mm = [5.0, 5.0, 5.0]
clock_offset_sd_s = 0.02

[rigs.imaging.sensor]
bits = 8
full_well_e = 10000.0

[[rigs.cameras]]
name = "cam"
model = "opencv_fisheye"
width_px = 120
height_px = 100
fx_px = 60.0
fy_px = 60.0
offset_mm = [3000.0, 0.0, 4000.0]

[[trajectories]]
name = "P001"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 240.0, above = "ground"}
radius_m = 200.0
speed_mps = 20.0
rate_hz = 1.0
num_frames = 3
)" + more);
  return replaced(text, "format = \"colmap\"\n", "format = \"terracast\"\n");
}

RunConfig config_of(const std::string& text, const std::vector<std::string>& sets = {}) {
  const test::ScratchFolder folder;
  return load_run_config(test::write_text(folder / "job.toml", text), sets);
}

Job job_of(const std::string& text, const std::vector<std::string>& sets = {}) {
  const core::Log log("job", core::LogLevel::Off);
  return prepare_job(config_of(text, sets), {.log = log});
}

std::vector<std::string> names_of(const std::vector<capture::CameraCalibration>& cameras) {
  std::vector<std::string> names;
  for (const capture::CameraCalibration& camera : cameras)
    names.push_back(camera.rig + "/" + camera.name);
  return names;
}

const capture::CameraCalibration& camera_of(const render::SequencePlan& plan,
                                            const std::string& name) {
  for (const capture::CameraCalibration& camera : plan.cameras)
    if (camera.rig + "/" + camera.name == name) return camera;
  throw std::logic_error("no camera " + name);
}

TEST(CarriedRigs, MistakesAreToldWithTheirPlace) {
  const auto refused = [](const std::vector<std::string>& sets,
                          const std::vector<std::string>& words) {
    test::expect_error(ErrorKind::Config, words, [&] { config_of(fleet_text(), sets); });
  };
  refused({"trajectories.1.rigs=[\"eie\"]"}, {"job.toml", "trajectories[1].rigs of P001",
                                              "unknown rig \"eie\"", "nearest: \"eye\"", "pair"});
  refused({"trajectories.1.rigs=[\"eye\", \"pair\", \"eye\"]"},
          {"trajectories[1].rigs of P001", "\"eye\" is named twice"});
  refused({"trajectories.0.rigs=[\"eye\"]"}, {"rigs[0]", "no trajectory carries the rig pair"});
  refused({"rigs.1.name=pair"}, {"two rigs are called pair"});
  refused({"trajectories.1.rigs=eye"}, {"rigs", "list"});
}

TEST(CarriedRigs, EachSequenceHasItsOwn) {
  const Job job = job_of(fleet_text(), {"trajectories.0.rigs=[\"pair\"]"});
  ASSERT_EQ(job.sequences.size(), 2U);
  const render::SequencePlan& pair = job.sequences[0];
  EXPECT_THAT(names_of(pair.cameras), ElementsAre("pair/left", "pair/right"));
  EXPECT_TRUE(pair.believed_cameras.empty());
  EXPECT_TRUE(pair.clocks.empty());
  EXPECT_TRUE(pair.imaging.empty());
  const render::SequencePlan& eye = job.sequences[1];
  EXPECT_THAT(names_of(eye.cameras), ElementsAre("eye/cam"));
  ASSERT_EQ(eye.believed_cameras.size(), 1U);
  EXPECT_NE(eye.believed_cameras[0], eye.cameras[0]);
  EXPECT_EQ(eye.clocks.size(), 1U);
  ASSERT_EQ(eye.imaging.size(), 1U);
  EXPECT_EQ(eye.imaging[0].sensor.full_well_e, 10000.0);
  // The eye's camera is 5 m from the body; of the pair the right one 0.5 m.
  EXPECT_THAT(half_sizes_m(job), ElementsAre(testing::DoubleNear(2048.0 - 0.5, 1e-9),
                                             testing::DoubleNear(2048.0 - 5.0, 1e-9)));

  for (const char* none : {"", "rigs = []\n"}) {
    const Job all = job_of(fleet_text(none));
    for (const render::SequencePlan& plan : all.sequences)
      EXPECT_THAT(names_of(plan.cameras), ElementsAre("pair/left", "pair/right", "eye/cam"));
  }
}

TEST(CarriedRigs, TheirErrorsAreTheSameWhateverElseIsCarried) {
  const Job alone = job_of(fleet_text());
  const Job beside = job_of(fleet_text(""));
  const Job other_order = job_of(fleet_text("rigs = [\"eye\", \"pair\"]\n"));
  const capture::CameraCalibration& eye = camera_of(alone.sequences[1], "eye/cam");
  EXPECT_EQ(camera_of(beside.sequences[1], "eye/cam"), eye);
  EXPECT_EQ(camera_of(other_order.sequences[1], "eye/cam"), eye);
  EXPECT_EQ(beside.sequences[1].clocks.at(2), alone.sequences[1].clocks.at(0));
  EXPECT_NE(camera_of(beside.sequences[0], "eye/cam"), eye) << "another sequence has others";
}

TEST(CarriedRigs, AllByNameAreAllWithout) {
  const Job without = job_of(fleet_text(""));
  const Job by_name = job_of(fleet_text("rigs = [\"eye\", \"pair\"]\n"),
                             {"trajectories.0.rigs=[\"pair\", \"eye\"]"});
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_tiny_world(
      folder / "world", [](double x, double y) { return 0.01 * x - 0.02 * y; });
  for (std::size_t i = 0; i < 2; ++i) {
    const render::SequencePlan& plan = without.sequences[i];
    EXPECT_EQ(by_name.sequences[i].config_toml, plan.config_toml);
    EXPECT_THAT(plan.config_toml,
                Not(HasSubstr("\nrigs = ")));  // as it was before there was the key
    const std::vector<world::CutTile> cut =
        world::choose_cut(store, render::viewpoints_of(plan), plan.detail);
    EXPECT_EQ(render::input_hash_of(by_name.sequences[i], store, cut),
              render::input_hash_of(plan, store, cut));
  }
}

TEST(CarriedRigs, ACaptureSaysOfOtherVehiclesRigsOnlyWhatItShows) {
  const RunConfig fleet = config_of(fleet_text(), {"trajectories.0.rigs=[\"pair\"]"});
  const auto record = [](const RunConfig& config, std::size_t trajectory) {
    return toml_of_sequence(config, config.trajectories[trajectory]);
  };
  // As if the first vehicle flew alone.
  std::string alone = fleet_text();
  alone = alone.substr(0, alone.find("[[rigs]]\nname = \"eye\""));
  EXPECT_EQ(record(fleet, 0), record(config_of(alone), 0));
  EXPECT_NE(record(fleet, 0), record(config_of(fleet_text()), 0)) << "it carries both rigs there";

  // What shares its geometry counts with all that it carries; what it says can be read again.
  RunConfig shared = fleet;
  shared.shared_geometry = true;
  for (std::size_t i = 0; i < 2; ++i) {
    RunConfig again;
    core::TomlDocument::parse(record(shared, i), "record.toml").read(again);
    ASSERT_EQ(again.rigs.size(), 2U);
    for (const geo::TrajectoryOptions& trajectory : again.trajectories)
      EXPECT_THAT(trajectory.rigs, ElementsAre(trajectory.name == "P000" ? "pair" : "eye"));
  }
}

TEST(CarriedRigs, FormatsAreHeldAgainstTheVehiclesThatTheyAreOf) {
  const std::vector<std::string> base = {"trajectories.0.rigs=[\"pair\"]"};
  const auto prepare = [&](const std::string& exports, const std::string& text = fleet_text()) {
    job_of(text, {base[0], "exports=[" + exports + "]"});
  };
  const auto refused = [&](const std::string& exports, const std::vector<std::string>& words) {
    test::expect_error(ErrorKind::Config, words, [&] { prepare(exports); });
  };
  const std::string kitti =
      "{format = \"kitti\", rig = \"pair\", left = \"left\", right = "
      "\"right\"}";
  EXPECT_NO_THROW(prepare(kitti));  // of P000 alone
  EXPECT_NO_THROW(prepare("{format = \"terracast\", rigs = [\"eye\"]}"));
  // The fewer points are enough for the one camera of the vehicle that it takes.
  EXPECT_NO_THROW(prepare("{format = \"colmap\", rigs = [\"eye\"]}"));
  refused("{format = \"kitti\", rig = \"pear\", left = \"left\", right = \"right\"}",
          {"unknown rig \"pear\"", "pair", "format kitti"});
  refused("{format = \"terracast\", rigs = [\"pair\", \"eie\"]}",
          {"unknown rig \"eie\"", "nearest: \"eye\"", "format terracast"});
  refused("{format = \"kitti_object\", rig = \"eye\", camera = \"cam\"}",
          {"opencv_fisheye", "pinhole", "sequence P001"});
  refused("{format = \"kitti_object\", rig = \"eye\", camera = \"can\"}", {"can", "sequence P001"});
}

}  // namespace
}  // namespace terracast::job
