// A flight over streets with traffic, from its config to the reports on datasets: every check of them holds.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/run_program.h"
#include "tests/support/street_job.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using testing::HasSubstr;

constexpr const char* kRest = R"([[traffic]]
amount = 5.0
reach_m = 150.0
most = 40

[[traffic]]
kind = "people"
amount = 8.0
reach_m = 60.0
most = 12

[[rigs]]
name = "tartan"
mount_pitch_deg = 15.0

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

[[exports]]
format = "tartanair_v1"
rig = "tartan"
)";

TEST(TrafficFlight, HoldsInEveryCheckAndFromAnyShards) {
  const ScratchFolder scratch;
  const fs::path job =
      write_text(scratch / "job.toml", street_job_text(scratch.path(), 3, "", kRest));
  const fs::path out = scratch / "out";
  const ProgramResult run = run_program({"run", job.string(), "--out", out.string()});
  ASSERT_EQ(run.status, 0) << run.output;
  EXPECT_THAT(run.output, HasSubstr("within reach of the cameras"));
  const Json report = Json::read(out / "report/tartanair_v1/report.json");
  int num_of_moving = 0;
  for (std::size_t i = 0; i < report.at("checks").size(); ++i) {
    const Json& check = report.at("checks").at(i);
    EXPECT_TRUE(check.at("ok").boolean()) << check.at("name").string();
    if (!check.at("name").string().starts_with("moving_")) continue;
    // Motions of what rides the ground are not asked.
    if (!check.at("skipped").boolean()) ++num_of_moving;
  }
  EXPECT_GE(num_of_moving, 3);
  const Json dataset = Json::read(out / "export/tartanair_v1/dataset.json");
  const Json& bodies = dataset.at("sequences").at(0).at("moving").at("bodies");
  int num_vehicles = 0, num_walkers = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const std::string& name = bodies.at(i).at("name").string();
    if (bodies.at(i).has("part_of") && !bodies.at(i).at("part_of").is_null()) continue;
    num_vehicles += name.starts_with("vehicle-") ? 1 : 0;
    num_walkers += name.starts_with("walker-") ? 1 : 0;
  }
  EXPECT_GE(num_vehicles, 8);
  EXPECT_GE(num_walkers, 2);

  // The same bytes of a frame from another process with one thread.
  const fs::path again = scratch / "again";
  const ProgramResult part =
      run_program({"render", job.string(), "--out", again.string(), "--world",
                   (out / "world").string(), "--shard", "1/3", "--threads", "1", "-q"});
  ASSERT_EQ(part.status, 0) << part.output;
  int num_files = 0;
  for (const auto& file : fs::recursive_directory_iterator(again / "capture/P000"))
    if (file.is_regular_file() && file.path().filename().string().starts_with("000001")) {
      const fs::path other = out / "capture" / fs::relative(file.path(), again / "capture");
      EXPECT_EQ(core::read_text_file(file.path()), core::read_text_file(other)) << other;
      ++num_files;
    }
  EXPECT_GE(num_files, 2);
}

}  // namespace
}  // namespace terracast::test
