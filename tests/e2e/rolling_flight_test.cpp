// A flight of rolling shutters, from its config to the reports on datasets of all formats that hold one: every check
// of them holds, and of a dataset that says otherwise how its lines follow each other the mistake is named.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using testing::HasSubstr;

/// The tiny job: an image takes 0.4 s of a turn at 30 m/s, which is 12 m and 2.3 degrees.
std::string job_text() {
  std::string text = tiny_job_text(R"([[exports]]
format = "kitti"
rig = "stereo"
left = "cam_left"
right = "cam_right"

[[exports]]
format = "kitti_raw"
rig = "stereo"
left = "cam_left"
right = "cam_right"

[[exports]]
format = "tartanair_v1"
rig = "tartan"

[[rigs]]
name = "stereo"
template = "stereo"
baseline_mm = 5000.0
mount_pitch_deg = 40.0

[[rigs.cameras]]
name = "cam"
width_px = 160
height_px = 120
fx_px = 120.0
line_time_us = 3333.0
readout = "up"

[[rigs]]
name = "tartan"
mount_pitch_deg = 50.0

[[rigs.cameras]]
name = "left"
width_px = 640
height_px = 480
fx_px = 320.0
fy_px = 320.0
line_time_us = 833.0

[[rigs.cameras]]
name = "right"
width_px = 640
height_px = 480
fx_px = 320.0
fy_px = 320.0
offset_mm = [0.0, -250.0, 0.0]
line_time_us = 833.0
)");
  // The two of the first rig differ: columns from the right, and rows.
  text = replaced(text, "format = \"colmap\"\n", "format = \"colmap\"\nrigs = [\"pair\"]\n");
  text = replaced(text, "fx_px = 120.0\nfy_px = 120.0\n\n",
                  "fx_px = 120.0\nfy_px = 120.0\nline_time_us = 2500.0\nreadout = \"left\"\n\n");
  return replaced(text, "offset_mm = [0.0, -500.0, 0.0]",
                  "offset_mm = [0.0, -500.0, 0.0]\nline_time_us = 3333.0");
}

TEST(RollingFlight, HoldsInEveryFormatAndItsMistakesAreNamed) {
  const ScratchFolder scratch;
  const fs::path job = write_text(scratch / "job.toml", job_text());
  const fs::path out = scratch / "out";
  const ProgramResult run = run_program({"run", job.string(), "--out", out.string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;

  for (const char* format : {"colmap", "kitti", "kitti_raw", "tartanair_v1"}) {
    SCOPED_TRACE(format);
    const Json dataset = Json::read(out / "export" / format / "dataset.json");
    EXPECT_THAT(dataset.at("conventions").at("shutter").string(), HasSubstr("motion.csv"));
    const Json& sequence = dataset.at("sequences").at(0);
    EXPECT_TRUE(fs::exists(out / "export" / format / sequence.at("motion").string()));
    EXPECT_GT(sequence.at("cameras").at(0).at("shutter").at("line_time_s").number(), 0.0);
    // What was looked at, of each line by its own pose.
    const Json report = Json::read(out / "report" / format / "report.json");
    int num_told = 0;
    for (std::size_t i = 0; i < report.at("checks").size(); ++i) {
      const Json& check = report.at("checks").at(i);
      const std::string name = check.at("name").string();
      for (const char* told : {"reprojection", "reprojection_line_time", "oracle_depth",
                               "bounds_depth", "bounds_arithmetic"})
        if (name == told) {
          EXPECT_FALSE(check.at("skipped").boolean()) << name;
          ++num_told;
        }
    }
    EXPECT_EQ(num_told, 5);
  }

  // Lines a tenth too slow, and from the other end.
  const fs::path folder = out / "export/kitti";
  const std::string text = core::read_text_file(folder / "dataset.json");
  const auto validate = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    for (auto at = changed.find(from); at != std::string::npos;
         at = changed.find(from, at + to.size()))
      changed.replace(at, from.size(), to);
    EXPECT_NE(changed, text) << from;
    core::write_file(folder / "dataset.json", std::string_view(changed));
    return run_program({"validate", folder.string(), "--report", (scratch / "wrong").string()});
  };
  const ProgramResult slow = validate("\"line_time_s\": 0.003333", "\"line_time_s\": 0.0036663");
  EXPECT_EQ(slow.status, 1) << slow.output;
  EXPECT_THAT(slow.output, HasSubstr("FAILED  reprojection_line_time"));
  // A steady turn tells the time of lines by depth alone to a tenth of the mistake.
  EXPECT_THAT(slow.output, HasSubstr("cause   all cameras: line_time_s of dataset.json is +9"));
  const ProgramResult turned = validate("\"readout\": \"up\"", "\"readout\": \"down\"");
  EXPECT_EQ(turned.status, 1) << turned.output;
  EXPECT_THAT(turned.output, HasSubstr("lines are read up, where dataset.json says down"));
}

}  // namespace
}  // namespace terracast::test
