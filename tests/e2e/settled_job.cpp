#include "tests/e2e/settled_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/json.h"
#include "tests/e2e/tiny_job.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;

constexpr double kLat_deg = 43.0;
constexpr double kLon_deg = 7.0;
/// A degree there, m.
constexpr double kNorth_m = 111086.0;
constexpr double kEast_m = 81541.0;

/// A slope that rises from a wavy shore, a sea floor of 1 in 11 down to 18 m, a valley for the river.
double height_m(double x, double y) {
  const double inland = y + 150.0 - 25.0 * std::sin(x / 120.0);
  if (inland < 0.0) return std::max(-18.0, 0.09 * inland) - 0.3;
  const double hills =
      6.0 * std::sin(x / 170.0 + 1.0) * std::clamp((inland - 100.0) / 200.0, 0.0, 1.0);
  const double valley =
      std::exp(-std::pow((x - 150.0) / 40.0, 2.0)) * std::min(1.0, inland / 100.0);
  return 2.0 + 0.03 * inland + 0.00006 * inland * inland + hills - 3.5 * valley;
}

void write_ground(const fs::path& folder) {
  constexpr int kCount = 100;
  constexpr double kCell_deg = 1.0 / 4000.0;
  const double west = kLon_deg - 0.5 * kCount * kCell_deg;
  const double south = kLat_deg - 0.5 * kCount * kCell_deg;
  std::string text = fmt::format(
      "ncols {0}\nnrows {0}\nxllcorner {1:.10f}\nyllcorner {2:.10f}\ncellsize {3:.10f}\n"
      "NODATA_value -9999\n",
      kCount, west, south, kCell_deg);
  for (int row = 0; row < kCount; ++row) {
    const double y = (south + (kCount - row - 0.5) * kCell_deg - kLat_deg) * kNorth_m;
    for (int column = 0; column < kCount; ++column)
      text += fmt::format("{:.3f} ",
                          height_m((west + (column + 0.5) * kCell_deg - kLon_deg) * kEast_m, y));
    text += "\n";
  }
  write_text(folder / "ground.asc", text);
  write_text(folder / "ground.prj",
             R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
             R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])");
}

using Places = std::vector<std::pair<double, double>>;
using Tags = std::vector<std::pair<std::string, std::string>>;

Places box(double x, double y, double width, double height) {
  return {{x, y}, {x + width, y}, {x + width, y + height}, {x, y + height}};
}

/// Features with OpenStreetMap's keys, by metres about the origin.
class Survey {
 public:
  void line(const Places& places, const Tags& tags) { add("LineString", places_of(places), tags); }
  void area(std::vector<Places> rings, const Tags& tags) {
    Json all = Json::array();
    for (Places& ring : rings) {
      ring.push_back(ring.front());
      all.push(places_of(ring));
    }
    add("Polygon", std::move(all), tags);
  }
  void point(double x, double y, const Tags& tags) { add("Point", place(x, y), tags); }
  void write(const fs::path& file) {
    Json::object()
        .set("type", "FeatureCollection")
        .set("features", std::move(features_))
        .write(file);
  }

 private:
  static Json place(double x, double y) {
    return Json::array_of({kLon_deg + x / kEast_m, kLat_deg + y / kNorth_m});
  }
  static Json places_of(const Places& places) {
    Json all = Json::array();
    for (const auto& [x, y] : places) all.push(place(x, y));
    return all;
  }
  void add(const char* type, Json coordinates, const Tags& tags) {
    Json properties = Json::object();
    for (const auto& [key, value] : tags) properties.set(key, value);
    features_.push(
        Json::object()
            .set("type", "Feature")
            .set("properties", std::move(properties))
            .set("geometry",
                 Json::object().set("type", type).set("coordinates", std::move(coordinates))));
  }
  Json features_ = Json::array();
};

void write_town(const fs::path& file) {
  Survey survey;
  survey.line({{150, 900}, {150, 400}, {152, 100}, {150, -160}},
              {{"waterway", "river"}, {"width", "14"}});
  survey.line({{-500, 40}, {100, 40}}, {{"highway", "secondary"}});
  survey.line({{100, 40}, {200, 40}},
              {{"highway", "secondary"}, {"bridge", "yes"}, {"layer", "1"}});
  survey.line({{200, 40}, {500, 40}}, {{"highway", "secondary"}});
  for (int i = 0; i < 4; ++i)
    survey.line({{-330 + 90 * i, 40}, {-330 + 90 * i, 330}}, {{"highway", "residential"}});
  for (int i = 0; i < 3; ++i)
    survey.line({{-330, 130 + 90 * i}, {-60, 130 + 90 * i}}, {{"highway", "residential"}});
  survey.area({box(-50, 52, 60, 30)}, {{"amenity", "parking"}});
  for (int i = 0; i < 6; ++i)
    survey.area({box(-390 + 52 * i, 14, 14, 12)},
                {{"building", "apartments"}, {"building:levels", fmt::format("{}", 3 + i % 3)}});
  for (int column = 0; column < 3; ++column)
    for (int row = 1; row < 3; ++row) {
      const double x = -320 + 90 * column;
      const double y = 50 + 90 * row;
      if ((column + row) % 2 != 0) {
        survey.area({box(x, y, 70, 68), box(x + 12, y + 12, 46, 44)},
                    {{"building", "apartments"}, {"building:levels", "5"}});
        continue;
      }
      for (int i = 0; i < 3; ++i) {
        survey.area({box(x + 2 + 23 * i, y + 2, 15, 11)}, {{"building", "house"}});
        survey.area({box(x + 2 + 23 * i, y + 50, 14, 12)}, {{"building", "house"}});
      }
    }
  Places towers;
  for (int i = 0; i < 5; ++i) towers.emplace_back(-420 + 190 * i, -20);
  for (const auto& [x, y] : towers) survey.point(x, y, {{"power", "tower"}});
  survey.line(towers, {{"power", "line"}});
  survey.line({{-200, -140}, {-200, -230}}, {{"man_made", "pier"}});
  survey.area({box(-190, -240, 90, 70)}, {{"leisure", "marina"}});
  survey.write(file);
}

}  // namespace

fs::path write_settled_job(const fs::path& folder) {
  fs::create_directories(folder);
  write_ground(folder);
  write_town(folder / "town.geojson");
  std::string layers;
  for (const char* kind : {"water", "roads", "buildings"})
    layers += fmt::format("[[world.layer]]\nkind = \"{}\"\nfiles = [\"town.geojson\"]\n", kind);
  layers +=
      "[[world.layer]]\nkind = \"land_cover\"\nsource = \"derived\"\nforest_share = 0.6\n"
      "[[world.layer]]\nkind = \"objects\"\nfiles = [\"town.geojson\"]\n"
      "[[world.layer]]\nkind = \"vegetation\"\n";
  return write_text(folder / "job.toml", R"(name = "settled"

[world]
name = "settled"
origin_lat_deg = 43.0
origin_lon_deg = 7.0
size_m = 1024.0
seed = 5
outside = "extend"
[[world.elevation]]
files = ["ground.asc"]
sea = "below"
sea_min_km2 = 0.01
vertical_datum = "egm96"
)" + layers + R"(
[detail]
cell_px = 8.0
finest_spacing_m = 2.0

[[rigs]]
name = "pair"
mount_pitch_deg = 25.0
[[rigs.cameras]]
name = "left"
width_px = 240
height_px = 180
fx_px = 180.0
[[rigs.cameras]]
name = "right"
width_px = 240
height_px = 180
fx_px = 180.0
offset_mm = [0.0, -500.0, 0.0]

[[rigs]]
extends = ")" + std::string(TERRACAST_SOURCE_DIR) +
                                             R"(/configs/rigs/tartan_v1.toml"
mount_pitch_deg = 25.0

[[trajectories]]
name = "P000"
kind = "waypoints"
rate_hz = 1.0
num_frames = 2
speed_mps = 8.0
waypoints = [
  {east_m = -300.0, north_m = -30.0, height_m = 70.0, above = "egm96"},
  {east_m = -285.0, north_m = -10.0, height_m = 68.0, above = "egm96"},
  {east_m = -255.0, north_m = 20.0, height_m = 68.0, above = "egm96"},
]

[[trajectories]]
name = "P001"
kind = "waypoints"
rate_hz = 1.0
num_frames = 2
speed_mps = 1.0
min_agl_m = -20.0
waypoints = [
  {east_m = -195.0, north_m = -255.0, height_m = -3.0, above = "egm96"},
  {east_m = -196.0, north_m = -250.0, height_m = -3.2, above = "egm96"},
  {east_m = -198.0, north_m = -240.0, height_m = -3.0, above = "egm96"},
]

[conditions]
color_samples = 1

[tracks]
num_points = 3000

[[exports]]
format = "colmap"
rigs = ["pair"]

[[exports]]
format = "kitti"
rig = "pair"
left = "left"
right = "right"

[[exports]]
format = "tartanair_v1"
rig = "tartan_v1"
sky_depth_m = 1e6
)");
}

}  // namespace terracast::test
