#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

/// A job whose memory is bounded from outside, from too little for anything up to enough.
namespace terracast::test {
namespace {

constexpr const char* kJob = R"(name = "job"
world = {name = "job", origin_lat_deg = 46.0, origin_lon_deg = 7.0, size_m = 512.0, outside = "extend", elevation = [{kind = "plane", vertical_datum = "ellipsoid", height_m = 500.0}]}
detail.finest_spacing_m = 2.0
rigs = [{name = "down", mount_pitch_deg = 60.0, cameras = [{name = "cam", width_px = 64, height_px = 48, fx_px = 60.0, fy_px = 60.0}]}]
trajectories = [{name = "P000", kind = "orbit", centre = {east_m = 0.0, north_m = 0.0, height_m = 150.0, above = "ground"}, radius_m = 150.0, speed_mps = 20.0, rate_hz = 1.0, num_frames = 2}]
conditions.color_samples = 1
)";

// The loader of a program that finds no room for its libraries says so by itself, with status 127.
TEST(LittleMemory, IsToldAsSuch) {
  const ScratchFolder scratch;
  core::write_file(scratch / "job.toml", std::string(kJob));
  constexpr int kIo = 4, kNotLoaded = 127;
  bool was_short = false, was_enough = false;
  for (int megabytes = 350; megabytes <= 4000 && !was_enough;
       megabytes += megabytes < 700 ? 35 : 500) {
    const ProgramResult run = run_command(
        "/bin/sh",
        {"-c", "ulimit -v \"$1\" && exec \"$2\" run \"$3\" --out \"$4\" --quiet", "sh",
         std::to_string(1000 * megabytes), TERRACAST_PROGRAM, (scratch / "job.toml").string(),
         (scratch / std::to_string(megabytes)).string()});
    was_enough = run.status == 0;
    if (was_enough || run.status == kNotLoaded) continue;
    EXPECT_EQ(run.status, kIo) << megabytes << " MB: " << run.output;
    EXPECT_NE(run.output.find("out of memory"), std::string::npos)
        << megabytes << " MB: " << run.output;
    was_short = true;
  }
  EXPECT_TRUE(was_short);
  EXPECT_TRUE(was_enough);
}

}  // namespace
}  // namespace terracast::test
