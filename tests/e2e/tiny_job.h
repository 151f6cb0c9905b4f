#pragma once

#include <stdexcept>
#include <string>

#include "tests/support/test_data.h"

namespace terracast::test {

/// A job that takes seconds: a fractal world of 4 km, one rig of two cameras of 160x120, four
/// frames, COLMAP.
/// extra   TOML appended at the end (tables only)
inline std::string tiny_job_text(const std::string& extra = "") {
  return R"(name = "tiny"

[world]
name = "tiny"
origin_lat_deg = 46.0
origin_lon_deg = 7.0
size_m = 4096.0
outside = "extend"

[[world.elevation]]
kind = "fractal"
vertical_datum = "ellipsoid"
relief_m = 300.0

[detail]
finest_spacing_m = 4.0

[[rigs]]
name = "pair"
mount_pitch_deg = 40.0

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

[[trajectories]]
name = "P000"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 250.0, above = "ground"}
radius_m = 300.0
speed_mps = 30.0
rate_hz = 1.0
num_frames = 4

[conditions]
color_samples = 1

[tracks]
num_points = 3000

[[exports]]
format = "colmap"

)" + extra;
}

/// `text` with the first occurrence of `what` replaced; the test fails loudly when it is not there.
inline std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  if (at == std::string::npos) throw std::logic_error("the tiny job does not hold: " + what);
  return text.replace(at, what.size(), by);
}

}  // namespace terracast::test
