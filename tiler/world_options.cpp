#include "tiler/world_options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/registry.h"
#include "geo/geoid.h"
#include "tiler/elevation_registry.h"
#include "tiler/no_data.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

/// With 7 km of the Earth's curve in a tile at the apron's far end this stays below the 16 km that
/// a tile's heights may span.
constexpr double kMostRise_m = 8000.0;

/// A shape in closed form may rise as its keys say over the whole square, and no further.
void validate_rise(const ElevationOptions& entry, std::size_t index, double size_m) {
  std::string shape;
  double rise_m = 0.0;
  if (entry.kind == "ramp") {
    shape = fmt::format("slope = {}", entry.slope);
    rise_m = std::abs(entry.slope) * size_m;
  } else if (entry.kind == "paraboloid") {
    shape = fmt::format("curvature_per_m = {}", entry.curvature_per_m);
    rise_m = std::abs(entry.curvature_per_m) * size_m * size_m / 4.0;  // from middle to corner
  }
  if (rise_m > kMostRise_m)
    fail(ErrorKind::Config,
         "elevation.{}: {} rises {:.0f} m over size_m = {}, and a world holds {:.0f} m; make one "
         "of the two smaller",
         index, shape, rise_m, size_m, kMostRise_m);
}

void validate_entry(const ElevationOptions& entry, std::size_t index) {
  core::find_registered(elevation_kinds(), "kind of elevation", entry.kind);
  const bool has_grid = entry.vertical_datum == "grid";
  if (!entry.vertical_datum.empty() && !has_grid)
    geo::check_vertical_datum_name(entry.vertical_datum);
  if (has_grid && entry.datum_grid.empty())
    fail(ErrorKind::Config,
         "elevation.{}: vertical_datum = \"grid\" needs datum_grid, the raster of what is added to "
         "the heights",
         index);
  if (!has_grid && !entry.datum_grid.empty())
    fail(ErrorKind::Config, "elevation.{}: datum_grid needs vertical_datum = \"grid\"", index);
  if (entry.kind != "raster") {
    if (entry.blend_m > 0.0)
      fail(ErrorKind::Config,
           "elevation.{}: blend_m makes an inset of rasters; kind = \"{}\" takes none", index,
           entry.kind);
    if (!entry.files.empty())
      fail(ErrorKind::Config,
           "elevation.{}: kind = \"{}\" reads no files, and {} are given; rasters need kind = "
           "\"raster\"",
           index, entry.kind, entry.files.size());
    return;
  }
  if (entry.files.empty())
    fail(ErrorKind::Config,
         "elevation.{}: kind = \"raster\" needs files = [\"…\"], the rasters in order of priority",
         index);
  if (entry.vertical_datum.empty())
    fail(ErrorKind::Config,
         "elevation.{}: no vertical_datum is stated for {}; say what its heights are above: "
         "\"egm96\" (SRTM and most older models), \"egm2008\", \"ellipsoid\" (GNSS heights) or "
         "\"grid\". It is never guessed: a wrong one shifts the world by 30 to 50 m",
         index, entry.files.front().written);
  if (entry.sea == "below" && entry.vertical_datum == "ellipsoid")
    fail(ErrorKind::Config,
         "elevation.{}: sea = \"below\" takes heights at 0 and below for sea, and 0 above the "
         "ellipsoid is no sea level; state egm96, egm2008 or grid",
         index);
  if (!NoData::from_text(entry.nodata))
    fail(ErrorKind::Config, "elevation.{}: nodata = \"{}\" is none of {}", index, entry.nodata,
         kNoDataWords);
}

/// Insets before what they stand in, and something procedural only where rasters end.
void validate_order(const WorldOptions& options) {
  const std::vector<ElevationOptions>& elevation = options.elevation;
  const auto rasters = static_cast<std::size_t>(
      std::count_if(elevation.begin(), elevation.end(),
                    [](const ElevationOptions& entry) { return entry.kind == "raster"; }));
  if (rasters == 0) {
    if (options.outside == "procedural")
      fail(ErrorKind::Config,
           "outside = \"procedural\" goes on where rasters end, and elevation.0 (kind = \"{}\") "
           "has a height everywhere",
           elevation.front().kind);
    return;
  }
  for (std::size_t i = 1; i < rasters; ++i)
    if (elevation[i].blend_m > 0.0 && elevation[i - 1].blend_m == 0.0)
      fail(
          ErrorKind::Config,
          "elevation.{}: an inset (blend_m = {}) stands behind elevation.{}, which is none; insets "
          "go first",
          i, elevation[i].blend_m, i - 1);
  if (elevation[rasters - 1].blend_m > 0.0)
    fail(ErrorKind::Config,
         "elevation.{}: an inset (blend_m = {}) needs rasters behind it, into which its border "
         "passes; where it is all there is, leave blend_m out and set outside = \"procedural\"",
         rasters - 1, elevation[rasters - 1].blend_m);
}

}  // namespace

std::optional<double> number_from_text(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

void WorldOptions::validate() const {
  if (elevation.empty())
    fail(ErrorKind::Config,
         "the world has no source of heights; add [[world.elevation]] with its kind (raster, "
         "procedural, …)");
  if (aridity_index >= 0.0 && !aridity_raster.empty())
    fail(ErrorKind::Config,
         "aridity_index = {} and aridity_raster = \"{}\" both say how dry the land is; leave one "
         "out",
         aridity_index, aridity_raster.written);
  for (std::size_t i = 0; i < elevation.size(); ++i) {
    validate_entry(elevation[i], i);
    validate_rise(elevation[i], i, size_m);
    if (i > 0 && elevation.front().kind != "raster")
      fail(ErrorKind::Config,
           "elevation.{} would never be asked: elevation.0 (kind = \"{}\") has a height "
           "everywhere; rasters go first",
           i, elevation.front().kind);
    if (i == 0 || elevation[i].kind == "raster") continue;
    const bool goes_on = elevation[i].kind == "procedural" && i + 1 == elevation.size();
    if (!goes_on || outside != "procedural")
      fail(ErrorKind::Config,
           "elevation.{}: kind = \"{}\" cannot stand behind rasters; where they do not reach, "
           "outside = \"sea\", \"extend\" or \"procedural\" says what lies there, and a last "
           "source of kind = \"procedural\" what \"procedural\" means",
           i, elevation[i].kind);
  }
  validate_order(*this);
  constexpr std::size_t kMostFiles = 200;  // tiles name the source of a sample in a byte
  std::size_t num_files = 0;
  for (const ElevationOptions& entry : elevation) num_files += entry.files.size();
  if (num_files > kMostFiles)
    fail(ErrorKind::Config, "{} rasters are given, and {} fit; join them with gdalbuildvrt",
         num_files, kMostFiles);
}

}  // namespace terracast::tiler
