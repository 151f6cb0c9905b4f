#include "tests/validate/fields/every_file_job.h"

#include <gtest/gtest.h>

#include "tests/support/made_once.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {

namespace {

constexpr const char* kJob = R"(name = "every_file"

[world]
name = "hills"
origin_lat_deg = 46.0
origin_lon_deg = 7.0
size_m = 4096.0
outside = "extend"

[[world.elevation]]
kind = "fractal"
vertical_datum = "ellipsoid"
relief_m = 100.0
licence = "generated; free of rights"

[detail]
finest_spacing_m = 4.0

[[rigs]]
name = "pair"
mount_pitch_deg = 40.0

[rigs.errors]
focal_length_sd_px = 1.0
azimuth_sd_deg = 0.2
pitch_sd_deg = 0.2
roll_sd_deg = 0.2
offset_sd_mm = [5.0, 5.0, 5.0]
clock_offset_sd_s = 0.02
clock_drift_sd_ppm = 100.0
clock_jitter_sd_s = 0.001

[[rigs.cameras]]
name = "left"
width_px = 160
height_px = 120
fx_px = 120.0
fy_px = 120.0

[[rigs.cameras]]
name = "right"
width_px = 160
height_px = 120
fx_px = 120.0
fy_px = 120.0
offset_mm = [0.0, -500.0, 0.0]

[[rigs.sensors]]
name = "laser"
kind = "rangefinder"
rate_hz = 20.0
offset_mm = [100.0, 0.0, -50.0]
euler_deg = [0.0, 50.0, 0.0]

[[rigs]]
name = "lines"
mount_pitch_deg = 40.0

[[rigs.cameras]]
name = "down"
width_px = 96
height_px = 72
fx_px = 70.0
line_time_us = 300.0

[[rigs.cameras]]
name = "wide"
model = "opencv_fisheye"
width_px = 96
height_px = 72
fx_px = 45.0
k1 = 0.02
k2 = -0.01
offset_mm = [0.0, -500.0, 0.0]

[[rigs]]
name = "stereo"
template = "stereo"
baseline_mm = 2000.0
mount_pitch_deg = 40.0

[[rigs.cameras]]
name = "cam"
width_px = 160
height_px = 120
fx_px = 120.0

[rigs.imaging.color]
saturation = 1.1

[[rigs]]
extends = "rigs/tartan2.toml"
mount_pitch_deg = 40.0

[[rigs]]
extends = "rigs/tartan_v1.toml"
mount_pitch_deg = 40.0

[[trajectories]]
name = "P000"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 120.0, above = "ground"}
radius_m = 300.0
speed_mps = 30.0
start_azimuth_deg = 90.0
rate_hz = 10.0
num_frames = 3

[[moving]]
name = "airliner"
thing = "airliner"
kind = "orbit"
ride = "free"
centre = {east_m = 0.0, north_m = 0.0, height_m = 75.0, above = "ground"}
radius_m = 300.0
speed_mps = 33.0
start_azimuth_deg = 81.0

[[moving]]
name = "car"
thing = "hatchback"
ride = "free"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 110.0, above = "ground"}
radius_m = 300.0
speed_mps = 30.0
start_azimuth_deg = 88.0

[[moving]]
name = "copter"
thing = "quadcopter"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 117.0, above = "ground"}
radius_m = 300.0
speed_mps = 30.0
start_azimuth_deg = 89.3

[conditions]
color_samples = 1

[tracks]
num_points = 4000

[[exports]]
format = "coco"
rig = "stereo"
categories = "own"

[[exports]]
format = "colmap"
rigs = ["pair"]
calibration = "believed"

[[exports]]
format = "kitti"
rig = "stereo"
left = "cam_left"
right = "cam_right"

[[exports]]
format = "kitti_object"
rig = "stereo"
camera = "cam_left"

[[exports]]
format = "kitti_raw"
rig = "stereo"
left = "cam_left"
right = "cam_right"

[[exports]]
format = "tartanair"
rig = "tartan2"

[[exports]]
format = "tartanair_v1"

[[exports]]
format = "terracast"
rigs = ["lines"]
)";

void make_job(const std::filesystem::path& folder) {
  std::string text = kJob;
  const std::string rigs = std::string(TERRACAST_SOURCE_DIR) + "/configs/rigs/";
  for (auto at = text.find("\"rigs/"); at != std::string::npos; at = text.find("\"rigs/", at + 1))
    text.replace(at + 1, 5, rigs);
  const std::filesystem::path job = write_text(folder / "job.toml", text);
  const ProgramResult run =
      run_program({"run", job.string(), "--out", (folder / "out").string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;
}

}  // namespace

std::filesystem::path every_file_job() { return made_once("every_file", kJob, make_job) / "out"; }

}  // namespace terracast::test
