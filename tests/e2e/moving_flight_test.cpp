// A flight among things that move, from its config to the reports on datasets: every check of them holds, of global and
// rolling shutters, and wrong poses and masks are found.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using testing::HasSubstr;

/// The tiny job with two flights that see each other, and a hall, a ship's size, that flies beside them: at 160 px
/// things that one looks at are large.
std::string job_text() {
  std::string text = tiny_job_text(R"([[exports]]
format = "kitti"
rig = "stereo"
left = "cam_left"
right = "cam_right"

[[exports]]
format = "tartanair_v1"
rig = "tartan"

[[rigs]]
name = "stereo"
template = "stereo"
baseline_mm = 500.0
mount_pitch_deg = 20.0

[[rigs.cameras]]
name = "cam"
width_px = 160
height_px = 120
fx_px = 120.0

[[rigs]]
name = "tartan"
mount_pitch_deg = 20.0

[[rigs.cameras]]
name = "left"
width_px = 640
height_px = 480
fx_px = 320.0
fy_px = 320.0

[[rigs.cameras]]
name = "right"
width_px = 640
height_px = 480
fx_px = 320.0
fy_px = 320.0
offset_mm = [0.0, -250.0, 0.0]

[[trajectories]]
name = "P001"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 247.0, above = "ground"}
radius_m = 300.0
speed_mps = 30.0
start_azimuth_deg = 84.0
rate_hz = 1.0
num_frames = 3
shown_as = "helicopter"

[[moving]]
name = "airliner"
thing = "airliner"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 220.0, above = "ground"}
radius_m = 300.0
speed_mps = 33.0
start_azimuth_deg = 76.0

[[moving]]
name = "late"
thing = "quadcopter"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 249.0, above = "ground"}
radius_m = 299.0
speed_mps = 30.0
start_azimuth_deg = 79.4
start_s = -1.5
)");
  text = replaced(text, "name = \"P000\"\nkind = \"orbit\"\n",
                  "name = \"P000\"\nkind = \"orbit\"\nstart_azimuth_deg = 90.0\n");
  text = replaced(text, "num_frames = 4", "num_frames = 3");
  text = replaced(text, "format = \"colmap\"\n", "format = \"colmap\"\nrigs = [\"pair\"]\n");
  // The first rig's lines follow each other.
  text = replaced(text, "fx_px = 120.0\nfy_px = 120.0\n\n",
                  "fx_px = 120.0\nfy_px = 120.0\nline_time_us = 500.0\n\n");
  return replaced(text, "mount_pitch_deg = 40.0", "mount_pitch_deg = 20.0");
}

/// The result of a check over the sequence P000.
Json check_of(const fs::path& report, const std::string& name) {
  const Json json = Json::read(report / "report.json");
  for (std::size_t i = 0; i < json.at("checks").size(); ++i) {
    const Json& check = json.at("checks").at(i);
    if (check.at("name").string() == name) return check;
  }
  return {};
}

TEST(MovingFlight, HoldsInEveryFormatAndItsMistakesAreFound) {
  const ScratchFolder scratch;
  const fs::path job = write_text(scratch / "job.toml", job_text());
  const fs::path out = scratch / "out";
  const ProgramResult run = run_program({"run", job.string(), "--out", out.string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;

  for (const char* format : {"colmap", "kitti", "tartanair_v1"}) {
    SCOPED_TRACE(format);
    const fs::path folder = out / "export" / format;
    const Json dataset = Json::read(folder / "dataset.json");
    EXPECT_THAT(dataset.at("conventions").at("moving").string(), HasSubstr("flow follows them"));
    const Json& moving = dataset.at("sequences").at(0).at("moving");
    // The airliner, what comes late with four rotors, the other flight's body with two.
    EXPECT_EQ(moving.at("bodies").size(), 1U + 5U + 3U);
    EXPECT_EQ(moving.at("bodies").at(2).at("part_of").string(), "late");
    const std::string states = core::read_text_file(folder / moving.at("states").string());
    EXPECT_THAT(states, testing::Not(HasSubstr("\n1,2,"))) << "it is not there yet";
    EXPECT_THAT(states, HasSubstr("\n2,2,"));
    const fs::path report = out / "report" / format;
    for (const char* name : {"moving_depth", "moving_see_through"})
      EXPECT_FALSE(check_of(report, name).at("skipped").boolean()) << name;
  }
  EXPECT_FALSE(check_of(out / "report/tartanair_v1", "moving_flow").at("skipped").boolean());

  // The same bytes from two shards with one thread.
  const fs::path sharded = scratch / "sharded";
  for (const std::vector<std::string>& stage : {std::vector<std::string>{"tile"},
                                                {"render", "--shard", "1/2", "--threads", "1"},
                                                {"render", "--shard", "0/2", "--threads", "1"}}) {
    std::vector<std::string> arguments = {stage[0], job.string(), "--out", sharded.string(), "-q"};
    arguments.insert(arguments.end(), stage.begin() + 1, stage.end());
    const ProgramResult part = run_program(arguments);
    ASSERT_EQ(part.status, 0) << part.output;
  }
  EXPECT_EQ(first_difference(out / "capture", sharded / "capture"), "");

  // The airliner two metres beside where it is; and as it is at the next frame.
  const fs::path folder = out / "export/tartanair_v1";
  const Json dataset = Json::read(folder / "dataset.json");
  const fs::path states = folder / dataset.at("sequences").at(0).at("moving").at("states").string();
  const std::string text = core::read_text_file(states);
  const auto validate = [&](const std::string& changed) {
    EXPECT_NE(changed, text);
    core::write_file(states, std::string_view(changed));
    const ProgramResult result =
        run_program({"validate", folder.string(), "--report", (scratch / "wrong").string()});
    EXPECT_EQ(result.status, 1) << result.output;
    return check_of(scratch / "wrong", "moving_flow");
  };
  const auto at = text.find("\n1,1,") + 5;
  const auto end = text.find(',', at);
  const double x_m = std::stod(text.substr(at, end - at));
  const Json beside =
      validate(std::string(text).replace(at, end - at, fmt::format("{:.17g}", x_m + 2.0)));
  EXPECT_FALSE(beside.at("ok").boolean());
  EXPECT_GT(beside.at("value").number(), 1.0);
  std::string swapped = text;
  swapped.replace(swapped.find("\n1,1,"), 5, "\n9,1,");
  swapped.replace(swapped.find("\n2,1,"), 5, "\n1,1,");
  swapped.replace(swapped.find("\n9,1,"), 5, "\n2,1,");
  EXPECT_FALSE(validate(swapped).at("ok").boolean());
  // A mask of the next frame.
  core::write_file(states, std::string_view(text));
  const fs::path masks =
      folder / dataset.at("sequences").at(0).at("moving").at("masks").string() / "left";
  fs::copy_file(masks / "000001.png", masks / "000000.png", fs::copy_options::overwrite_existing);
  const ProgramResult result =
      run_program({"validate", folder.string(), "--report", (scratch / "wrong").string()});
  EXPECT_EQ(result.status, 1) << result.output;
  const Json flow = check_of(scratch / "wrong", "moving_flow");
  const Json through = check_of(scratch / "wrong", "moving_see_through");
  EXPECT_FALSE(flow.at("ok").boolean() && through.at("ok").boolean());
}

TEST(MovingFlight, WhatCannotBeIsRefusedWithWhatWouldBe) {
  const ScratchFolder scratch;
  const auto refused = [&](const std::string& moving, int status, const char* message) {
    const fs::path job = write_text(scratch / "job.toml", tiny_job_text(moving));
    const ProgramResult run =
        run_program({"render", job.string(), "--out", (scratch / "out").string(), "-q"});
    EXPECT_EQ(run.status, status) << run.output;
    EXPECT_THAT(run.output, HasSubstr(message));
  };
  const std::string orbit =
      "kind = \"orbit\"\ncentre = {east_m = 0.0, north_m = 0.0, height_m = 200.0}\nradius_m = "
      "50.0\n";
  const auto thing = [&](const std::string& keys) { return "[[moving]]\n" + keys + orbit; };
  constexpr int kConfig = 2;
  refused(thing("name = \"a\"\nthing = \"helicoptre\"\n"), kConfig, "helicopter");
  refused(thing("name = \"a\"\nthing = \"helicopter\"\nvariant = 9\n"), kConfig,
          "has 4 colours, counted from 0");
  refused(thing("name = \"a/b\"\nthing = \"helicopter\"\n"), kConfig, "1 to 64 letters");
  refused(thing("name = \"a\"\nthing = \"helicopter\"\n") +
              thing("name = \"a\"\nthing = \"helicopter\"\n"),
          kConfig, "two things that move are called \"a\"");
  refused(thing("name = \"a\"\nthing = \"helicopter\"\nride = \"rails\"\n"), kConfig, "ride");
}

}  // namespace
}  // namespace terracast::test
