// A job whose rigs have errors, from its config to the reports on datasets that state what is believed.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "capture/frame_reader.h"
#include "core/atomic_file.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// The tiny job; its rig has all errors, and a rectified pair beside it those of clocks.
std::string job_text() {
  const std::string errors = R"([rigs.errors]
focal_length_sd_px = 1.0
azimuth_sd_deg = 0.2
pitch_sd_deg = 0.2
roll_sd_deg = 0.2
offset_sd_mm = [5.0, 5.0, 5.0]
clock_offset_sd_s = 0.02

)";
  const std::string stereo = R"(calibration = "believed"
rigs = ["pair"]

[[exports]]
format = "kitti_raw"
rig = "stereo"
left = "cam_left"
right = "cam_right"
calibration = "believed"

[[exports]]
format = "kitti"
rig = "stereo"
left = "cam_left"
right = "cam_right"
calibration = "believed"
disparity = "off"

[[rigs]]
name = "stereo"
template = "stereo"
baseline_mm = 500.0
mount_pitch_deg = 40.0

[rigs.errors]
clock_offset_sd_s = 0.02
clock_drift_sd_ppm = 100.0
clock_jitter_sd_s = 0.001

[[rigs.cameras]]
name = "cam"
width_px = 160
height_px = 120
fx_px = 120.0
)";
  const std::string first = "[[rigs.cameras]]\nname = \"left\"";
  const std::string text = replaced(tiny_job_text(), first, errors + first);
  return replaced(text, "format = \"colmap\"\n", "format = \"colmap\"\n" + stereo);
}

TEST(RigErrors, OfADatasetThatStatesWhatIsBelievedAreKnownToItsChecks) {
  const ScratchFolder scratch;
  const fs::path job = write_text(scratch / "job.toml", job_text());
  const fs::path out = scratch / "out";
  const ProgramResult run = run_program({"run", job.string(), "--out", out.string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;

  const auto capture = capture::SequenceReader::open(out / "capture/P000");
  const capture::SequenceInfo& info = capture.info();
  ASSERT_EQ(info.cameras.size(), 4u);
  EXPECT_EQ(info.believed()[0].intrinsics.parameters[0], 120.0);
  EXPECT_NE(info.cameras[0].intrinsics.parameters[0], 120.0);
  EXPECT_EQ(info.cameras[2], info.believed()[2]);  // its clock alone errs

  const fs::path dataset = out / "export/colmap";
  const std::string report = core::read_text_file(out / "report/colmap/index.html");
  EXPECT_THAT(report, HasSubstr("state what is believed of its cameras"));

  // Taken for the truth, what is believed is found to be wrong.
  const fs::path file = dataset / "dataset.json";
  const std::string text = core::read_text_file(file);
  core::write_file(file, std::string_view(replaced(text, "\"calibration\": \"believed\"",
                                                   "\"calibration\": \"true\"")));
  const ProgramResult taken =
      run_program({"validate", dataset.string(), "--report", (scratch / "taken").string(), "-q"});
  EXPECT_EQ(taken.status, 1) << taken.output;
  for (const char* check : {"calibration_intrinsics", "calibration_rotation",
                            "georeference_rotation", "colmap_reprojection"})
    EXPECT_THAT(taken.output, HasSubstr(std::string("FAILED  ") + check));
}

}  // namespace
}  // namespace terracast::test
