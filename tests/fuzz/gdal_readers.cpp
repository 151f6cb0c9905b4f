// Rasters and features, which GDAL reads for us. GDAL itself is not instrumented: what is found in it is what ends the
// process, or what our own code makes of its results.

#include <algorithm>
#include <array>
#include <string>

#include "core/error.h"
#include "geo/geoid.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/small_world.h"
#include "tiler/geojson_crs.h"
#include "tiler/imagery/color_raster.h"
#include "tiler/land_cover/cover_raster.h"
#include "tiler/land_cover/legend.h"
#include "tiler/offset_grid.h"
#include "tiler/osm_census.h"
#include "tiler/raster_source.h"
#include "tiler/vector_source.h"

namespace terracast::fuzz {
namespace {

namespace fs = std::filesystem;

core::Path path_of(const fs::path& file) {
  return {.written = file.filename().string(), .resolved = file};
}

/// Heights of a part of a raster, and all that a world keeps of it.
void read_raster(const fs::path& file, const tiler::ElevationOptions& options) {
  const auto source = tiler::RasterSource::open(
      path_of(file), options, {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg});
  source->read({0, 0, std::min(source->grid().width(), 64), std::min(source->grid().height(), 64)});
  source->corner_heights_m();
  source->ledger();
  source->content_hash();
}

void read_raster(const fs::path& file) {
  tiler::ElevationOptions options;
  options.vertical_datum = "ellipsoid";
  options.trust = "config";
  read_raster(file, options);
}

void read_features(const fs::path& file) {
  const SmallWorld world;
  const tiler::VectorData data = tiler::read_vectors(path_of(file), {}, world.frame());
  data.left_out();
}

}  // namespace

void fuzz_raster_tif(Bytes input) { read_raster(put("dem.tif", input)); }

/// A grid of text, in the system that its neighbour names.
void fuzz_raster_asc(Bytes input) {
  const fs::path file = put("dem.asc", input);
  write_bytes(file.parent_path() / "dem.prj",
              bytes_of("GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,"
                       "298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\","
                       "0.0174532925199433]]"));
  read_raster(file);
}

/// A VRT with a grid of text that it may name.
void fuzz_raster_vrt(Bytes input) {
  static constexpr std::array<std::string_view, 2> kNames = {"dem.vrt", "grid.asc"};
  read_raster(put_parts(input, kNames) / "dem.vrt");
}

/// Parts of the names z/x/y.png are the tiles of a folder.
void fuzz_terrain_tiles(Bytes input) {
  const fs::path folder = fresh_folder() / "tiles";
  fs::create_directory(folder);
  for (const Part& part : parts_of(input)) {
    const std::string_view name = part.name.substr(0, part.name.find_last_of('.'));
    if (!part.name.ends_with(".png") || name.size() > 40 || name.starts_with('/') ||
        !std::all_of(name.begin(), name.end(),
                     [](char c) { return c == '/' || (c >= '0' && c <= '9'); }))
      continue;
    const fs::path file = folder / part.name;
    fs::create_directories(file.parent_path());
    if (!fs::is_directory(file)) write_bytes(file, part.bytes);
  }
  tiler::ElevationOptions options;
  options.vertical_datum = "egm96";
  options.encoding = "terrarium";
  read_raster(folder, options);
}

void fuzz_color_raster(Bytes input) {
  const fs::path file = put("photo.tif", input);
  const SmallWorld world;
  const tiler::ColorRaster raster(path_of(file), {}, world.inputs());
  raster.content_hash();
}

void fuzz_cover_raster(Bytes input) {
  const fs::path file = put("cover.tif", input);
  const SmallWorld world;
  static const tiler::Legend legend = tiler::make_legend("worldcover", {});
  const tiler::CoverRaster raster(path_of(file), legend, {}, world.inputs());
  for (const double x : {-900.0, 0.0, 900.0})
    if (raster.touches_square()) raster.find({x, 0.5 * x}, 800.0);
  raster.info("cover.tif");
}

/// A grid of PROJ's, made a geoid.
void fuzz_offset_grid(Bytes input) {
  const auto geoid =
      geo::Geoid::from_grid(tiler::read_offset_grid(path_of(put("grid.gtx", input))));
  geoid->undulation_m(kOriginLat_deg, kOriginLon_deg);
  geoid->covers(kOriginLat_deg, kOriginLon_deg);
}

void fuzz_features_geojson(Bytes input) { read_features(put("things.geojson", input)); }
void fuzz_features_osm(Bytes input) { read_features(put("things.osm", input)); }
void fuzz_features_pbf(Bytes input) { read_features(put("things.osm.pbf", input)); }
void fuzz_features_gpkg(Bytes input) { read_features(put("things.gpkg", input)); }
void fuzz_features_kml(Bytes input) { read_features(put("things.kml", input)); }

/// The files of a shape, of which the first three begin by their lengths of two bytes.
void fuzz_features_shape(Bytes input) {
  const fs::path folder = fresh_folder();
  Front front(input);
  for (const char* name : {"things.shp", "things.shx", "things.dbf"})
    write_bytes(folder / name, front.take(front.number(2)));
  write_bytes(folder / "things.prj", front.rest());
  read_features(folder / "things.shp");
}

void fuzz_geojson_crs(Bytes input) { tiler::check_geojson_crs(path_of(put("a.geojson", input))); }
void fuzz_osm_census(Bytes input) { tiler::count_osm(put("a.osm", input)).counts(); }
void fuzz_pbf_census(Bytes input) { tiler::count_osm(put("a.osm.pbf", input)).counts(); }

}  // namespace terracast::fuzz
