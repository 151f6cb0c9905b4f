#include "tiler/elevation_registry.h"

#include <array>

#include "tiler/offset_grid.h"

namespace terracast::tiler {
namespace {

constexpr std::array kKinds = {
    ElevationKindInfo{"fractal", "Hills of gradient noise, known at every place.", make_fractal},
    ElevationKindInfo{"paraboloid", "height_m + curvature_per_m r^2 / 2.", make_paraboloid},
    ElevationKindInfo{"plane", "One height above the datum.", make_plane},
    ElevationKindInfo{"procedural", "Seeded land: eroded mountains, valleys, plain, coast and sea.",
                      make_procedural},
    ElevationKindInfo{"ramp", "height_m + slope x.", make_ramp},
    ElevationKindInfo{"raster", "Rasters that GDAL opens, brought together into one mosaic.",
                      make_raster},
};

}  // namespace

std::span<const ElevationKindInfo> elevation_kinds() { return kKinds; }

geo::VerticalDatum datum_of(const ElevationOptions& options) {
  if (options.vertical_datum.empty()) return {};
  if (options.vertical_datum == "grid")
    return {options.datum_grid.written,
            geo::Geoid::from_grid(read_offset_grid(options.datum_grid))};
  return geo::vertical_datum_from_name(options.vertical_datum);
}

}  // namespace terracast::tiler
