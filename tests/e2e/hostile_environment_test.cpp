#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/folder_compare.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/tiler/hostile_inputs.h"

namespace terracast::test {
namespace {

constexpr const char* kJob = R"(name = "tiny"

[world]
name = "tiny"
origin_lat_deg = 42.5
origin_lon_deg = 1.5
size_m = 2048.0

[[world.elevation]]
kind = "raster"
files = ["point.tif", "grid.asc"]
vertical_datum = "egm96"

[detail]
finest_spacing_m = 16.0

[[rigs]]
name = "one"

[[rigs.cameras]]
name = "left"
width_px = 64
height_px = 48
fx_px = 48.0
fy_px = 48.0

[[trajectories]]
name = "P000"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 150.0, above = "ground"}
radius_m = 300.0
speed_mps = 30.0
rate_hz = 1.0
num_frames = 2
)";

ProgramResult tile(const std::filesystem::path& job, const std::filesystem::path& out,
                   std::vector<std::string> variables) {
  variables.insert(variables.end(),
                   {TERRACAST_PROGRAM, "tile", job.string(), "--out", out.string()});
  return run_command("/usr/bin/env", variables);
}

TEST(HostileEnvironment, TheProgramTilesTheSameWorldAndNamesWhatItDoesNotHeed) {
  const ScratchFolder scratch;
  write_inputs(scratch.path());
  const auto job = write_text(scratch / "job.toml", kJob);
  const auto plain = tile(job, scratch / "plain", {});
  ASSERT_EQ(plain.status, 0) << plain.output;
  const auto hostile = tile(job, scratch / "hostile", hostile_variables(scratch / "home"));
  ASSERT_EQ(hostile.status, 0) << hostile.output;
  EXPECT_EQ(first_difference(scratch / "plain" / "world", scratch / "hostile" / "world"), "");
  for (const char* name : {"not heeded", "GTIFF_POINT_GEO_IGNORE", "PROJ_NETWORK", "OGR_CT_"})
    EXPECT_NE(hostile.output.find(name), std::string::npos) << name << "\n" << hostile.output;
}

}  // namespace
}  // namespace terracast::test
