#pragma once

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace terracast::test {

/// Streets on gentle hills: a main street from west to east with sidewalks, side streets into it, and a road from
/// south to north that goes over it on a bridge of 80 m; a footway beside it. Places are metres about 46 N 7 E.
inline std::string street_features() {
  const double north_m = 111147.0;
  const double east_m = 77464.0;
  using Places = std::vector<std::pair<double, double>>;
  std::string text;
  const auto add = [&](const Places& places, const std::string& tags) {
    std::string line;
    for (const auto& [x, y] : places)
      line += fmt::format("{}[{:.9f},{:.9f}]", line.empty() ? "" : ",", 7.0 + x / east_m,
                          46.0 + y / north_m);
    text += fmt::format(
        "{}{{\"type\":\"Feature\",\"properties\":{{{}}},\"geometry\":{{\"type\":\"LineString\","
        "\"coordinates\":[{}]}}}}",
        text.empty() ? "" : ",", tags, line);
  };
  const std::string street = R"("highway":"residential","sidewalk":"both")";
  Places crossings = {{-800, 0}};
  for (int i = -4; i <= 4; ++i) crossings.emplace_back(150 * i + 60, 0);
  crossings.emplace_back(800, 0);
  add(crossings, R"("highway":"primary","sidewalk":"both","maxspeed":"50")");
  for (int i = -4; i <= 4; ++i) {
    const double x = 150 * i + 60;
    add({{x, -400}, {x, 0}, {x, 400}}, street);
  }
  for (const double y : {-400.0, -200.0, 200.0, 400.0}) {
    Places row;
    for (int i = -4; i <= 4; ++i) row.emplace_back(150 * i + 60, y);
    if (std::abs(y) > 300.0) add(row, street);
  }
  const std::string over = R"("highway":"secondary","maxspeed":"60")";
  add({{-15, -800}, {-15, -40}}, over);
  add({{-15, -40}, {-15, 40}}, over + R"(,"bridge":"yes","layer":"1")");
  add({{-15, 40}, {-15, 800}}, over);
  add({{-700, 14}, {-100, 16}, {-60, 60}}, R"("highway":"footway")");
  return "{\"type\":\"FeatureCollection\",\"features\":[" + text + "]}";
}

/// A job over them in a folder, whose one sequence goes low along the main street towards the bridge.
/// layers   of the world, beside the streets
/// rest     TOML, tables only
inline std::string street_job_text(const std::filesystem::path& folder, int num_frames,
                                   const std::string& layers, const std::string& rest) {
  std::ofstream(folder / "streets.geojson", std::ios::binary) << street_features();
  return fmt::format(R"(name = "streets"

[world]
name = "streets"
origin_lat_deg = 46.0
origin_lon_deg = 7.0
size_m = 2048.0
outside = "extend"

[[world.elevation]]
kind = "fractal"
vertical_datum = "ellipsoid"
relief_m = 40.0

[[world.layer]]
kind = "roads"
files = ["streets.geojson"]

{}
[detail]
cell_px = 8.0
finest_spacing_m = 1.0

[[trajectories]]
name = "P000"
kind = "waypoints"
rate_hz = 2.0
num_frames = {}
speed_mps = 6.0
waypoints = [
  {{east_m = -100.0, north_m = -9.0, height_m = 9.0, above = "ground"}},
  {{east_m = 20.0, north_m = -8.0, height_m = 9.0, above = "ground"}},
]

[conditions]
color_samples = 1

[tracks]
num_points = 3000

{})",
                     layers, num_frames, rest);
}

}  // namespace terracast::test
