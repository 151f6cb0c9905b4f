#include "tests/tiler/settled_files.h"

#include <fmt/format.h>

#include <cmath>

#include "core/atomic_file.h"
#include "tests/tiler/vector_files.h"
#include "world/vdb/vdb_file.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Tags = std::vector<std::pair<std::string, std::string>>;

constexpr double kSize_m = 2048.0;

/// Degrees of places in the world, as WKT has them.
std::string points_of(const std::vector<Vector2d>& places_world) {
  const geo::WorldFrame frame(
      {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
  std::string text;
  for (const Vector2d& place : places_world) {
    const geo::Geodetic at = frame.geodetic_from_world({place.x(), place.y(), 0.0});
    text += fmt::format("{}{:.11f} {:.11f}", text.empty() ? "" : ", ", at.lon_deg, at.lat_deg);
  }
  return text;
}
std::string line(const std::vector<Vector2d>& places) {
  return "LINESTRING (" + points_of(places) + ")";
}
std::string ring(double x, double y, double width_m, double depth_m) {
  return "(" +
         points_of(
             {{x, y}, {x + width_m, y}, {x + width_m, y + depth_m}, {x, y + depth_m}, {x, y}}) +
         ")";
}
std::string area(double x, double y, double width_m, double depth_m) {
  return "POLYGON (" + ring(x, y, width_m, depth_m) + ")";
}

std::vector<VectorSpec> features() {
  std::vector<VectorSpec> all;
  const auto add = [&](const std::string& wkt, Tags tags) {
    tags.emplace_back("osm_way_id", std::to_string(100 + all.size()));
    all.push_back({wkt, std::move(tags)});
  };
  add(line({{-1000, -50}, {-300, -30}, {300, -40}, {1000, -60}}),
      {{"waterway", "river"}, {"width", "12"}});
  add(area(300, 300, 200, 120), {{"natural", "water"}});
  // The bridge leads over the river and over the border of tiles at y = 0.
  add(line({{40, -900}, {40, -90}}), {{"highway", "secondary"}});
  add(line({{40, -90}, {40, 15}}), {{"highway", "secondary"}, {"bridge", "yes"}, {"layer", "1"}});
  add(line({{40, 15}, {40, 900}}), {{"highway", "secondary"}});
  add(line({{-700, 120}, {700, 120}}), {{"highway", "residential"}});
  add(line({{-800, -300}, {-200, -250}, {200, -250}, {800, -280}}), {{"railway", "rail"}});
  add(line({{-900, 520}, {-300, 500}, {300, 500}, {900, 530}}),
      {{"power", "line"}, {"voltage", "110000"}});
  add(line({{-120, 90}, {120, 90}}), {{"barrier", "hedge"}});
  add(area(-40, -200, 80, 40), {{"amenity", "parking"}});
  add(area(-60, -140, 90, 60), {{"leisure", "pitch"}});
  add(area(-18, 60, 30, 16), {{"building", "school"}});
  for (int i = -14; i <= 14; ++i) {
    const double x = 44.0 * i - 9.0;
    add(area(x, 140 + i % 3, 18, 11), {{"building", i % 4 == 0 ? "apartments" : "house"}});
    add(area(x, 88 - i % 2, 14, 12), {{"building", "house"}, {"building:levels", "2"}});
  }
  // A block round its yard, over the corner of four tiles.
  add("POLYGON (" + ring(-30, 190, 60, 50) + ", " + ring(-18, 202, 36, 26) + ")",
      {{"building", "yes"}});
  return all;
}

RasterSpec raster_of(double spacing_m, GDALDataType type,
                     std::function<double(double, double)> value) {
  RasterSpec spec = utm_spec(kSize_m, spacing_m);
  spec.type = type;
  spec.value = std::move(value);
  return spec;
}

void write_rasters(const fs::path& folder) {
  const Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  // ESA WorldCover: trees in the south and west, crops in the north-east, grass between.
  write_raster(folder / "cover.tif", raster_of(10.0, GDT_Byte, [=](double u, double v) {
                 const double x = u - middle.x(), y = v - middle.y();
                 return y < -60.0 || x < -300.0 ? 10.0 : y > 250.0 && x > 100.0 ? 40.0 : 30.0;
               }));
  write_raster(
      folder / "canopy.tif", raster_of(8.0, GDT_Float32, [=](double u, double v) {
        const double x = u - middle.x(), y = v - middle.y();
        return y < -60.0 || x < -300.0 ? 9.0 + 6.0 * std::sin(x / 31.0) * std::cos(y / 23.0) : 0.0;
      }));
  write_raster(folder / "roofs.tif", raster_of(4.0, GDT_Float32, [](double u, double) {
                 return 6.0 + std::fmod(std::abs(u), 40.0) / 10.0;
               }));
  write_raster(folder / "picture.tif", raster_of(16.0, GDT_Byte, [](double u, double v) {
                 return 40.0 + std::fmod(std::abs(u) / 7.0 + std::abs(v) / 3.0, 150.0);
               }));
}

void write_things(const fs::path& folder) {
  write_text(folder / "red.mtl", "newmtl red\nKd 0.8 0.1 0.1\n");
  write_text(folder / "hut.obj",
             "mtllib red.mtl\nusemtl red\nv 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nv 2 5 1.5\nf 1 2 3 "
             "4\nf 1 5 2\nf 2 5 "
             "3\nf 3 5 4\nf 4 5 1\n");
  write_text(folder / "list.csv",
             "thing,x,y,heading_deg\nred_hut,0.5,-0.5,20\nhatchback,-1,30,45\nairliner,-260,-512,"
             "90\nred_hut,512,700,0\n");
  world::Volume volume;
  volume.name = "density";
  volume.size = {12, 9, 7};
  volume.voxel_m = 20.0;
  volume.lowest_m = {-120.0, -90.0, 0.0};
  for (int i = 0; i < volume.size.prod(); ++i)
    volume.density.push_back(static_cast<std::uint8_t>(255 - i % 200));
  const world::VdbGrid grid{.name = "density", .volume = &volume};
  core::write_file(folder / "smoke.vdb", world::encode_vdb({&grid, 1}));
}

}  // namespace

std::vector<std::string> write_settled_files(const fs::path& folder) {
  write_vectors(folder / "village.geojson", "GeoJSON", features());
  write_rasters(folder);
  write_things(folder);
  const auto file = [&](const char* name) { return "\"" + (folder / name).string() + "\""; };
  const std::string features = "files = [" + file("village.geojson") + "]\n";
  return {features + "placements = [" + file("list.csv") +
              "]\nmodels = [{name = \"red_hut\", file = " + file("hut.obj") + "}]",
          features + "heights = " + file("roofs.tif"),
          "legend = \"worldcover\"\nfiles = [" + file("cover.tif") + "]",
          "canopy = " + file("canopy.tif"),
          "source = \"vdb\"\nheight_m = 700.0\nfile = " + file("smoke.vdb"),
          "transfer = \"srgb\"\nfiles = [" + file("picture.tif") + "]",
          features};
}

}  // namespace terracast::test
