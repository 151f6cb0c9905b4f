#include "tiler/offset_grid.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "tiler/gdal_support.h"
#include "tiler/raster_claims.h"
#include "tiler/raster_ledger.h"

namespace terracast::tiler {

using core::ErrorKind;
using core::fail;

namespace {

/// What is made of a band's numbers.
struct Metres {
  double scale = 1.0;
  double offset = 0.0;

  Metres(GDALRasterBand& band, const std::string& written) {
    const char* unit = band.GetUnitType();
    const std::optional<double> metres = metres_in(unit == nullptr ? "" : unit);
    if (!metres)
      fail(ErrorKind::Input,
           "{}: declares its offsets in \"{}\", which is no known unit of length; gdal_edit.py "
           "-units states another",
           written, unit);
    scale = band.GetScale() * *metres;
    offset = band.GetOffset() * *metres;
    if (!std::isfinite(scale) || !std::isfinite(offset) || scale == 0.0)
      fail(ErrorKind::Input,
           "{}: declares a scale of {} and an offset of {}; gdal_edit.py -scale -offset states "
           "others",
           written, band.GetScale(), band.GetOffset());
  }
};

}  // namespace

core::Ledger ledger_of_offset_grid(const core::Path& file) {
  const GdalErrors errors;
  return ledger_of(*open_gdal_raster(file, errors), {.what = "offsets", .uses_mask = false});
}

geo::OffsetGrid read_offset_grid(const core::Path& file) {
  const GdalErrors errors;
  const GdalDatasetPtr dataset = open_gdal_raster(file, errors);
  std::array<double, 6> gt = {};
  const OGRSpatialReference* crs = dataset->GetSpatialRef();
  const bool is_geographic = crs == nullptr || crs->IsGeographic() != FALSE;
  if (dataset->GetGeoTransform(gt.data()) != CE_None || gt[2] != 0.0 || gt[4] != 0.0 ||
      !(gt[1] > 0.0) || !(gt[5] < 0.0) || !is_geographic || dataset->GetRasterCount() < 1)
    fail(ErrorKind::Input,
         "{}: is no grid of offsets in latitude and longitude, north up; warp it with gdalwarp "
         "-t_srs EPSG:4326",
         file.written);
  constexpr std::int64_t kMostNodes = 50'000'000;
  geo::OffsetGrid grid;
  grid.name = file.written;
  grid.num_columns = dataset->GetRasterXSize();
  grid.num_rows = dataset->GetRasterYSize();
  const std::int64_t num_nodes = std::int64_t{grid.num_columns} * grid.num_rows;
  if (num_nodes > kMostNodes)
    fail(ErrorKind::Input,
         "{}: has {} nodes, and {} fit into memory; cut it out with "
         "gdal_translate -projwin",
         file.written, num_nodes, kMostNodes);
  grid.lon_step_deg = gt[1];
  grid.lat_step_deg = -gt[5];
  grid.west_deg = gt[0] + 0.5 * gt[1];
  grid.south_deg = gt[3] + (grid.num_rows - 0.5) * gt[5];
  GDALRasterBand* band = dataset->GetRasterBand(1);
  const Metres metres(*band, file.written);
  int has_nodata = FALSE;
  const double nodata = band->GetNoDataValue(&has_nodata);
  grid.offsets_m.resize(static_cast<std::size_t>(num_nodes));
  const auto columns = static_cast<std::size_t>(grid.num_columns);
  for (int row = 0; row < grid.num_rows; ++row) {
    double* const southwards =
        &grid.offsets_m[static_cast<std::size_t>(grid.num_rows - 1 - row) * columns];
    if (band->RasterIO(GF_Read, 0, row, grid.num_columns, 1, southwards, grid.num_columns, 1,
                       GDT_Float64, 0, 0, nullptr) != CE_None)
      fail(ErrorKind::Input, "{}: its nodes cannot be read; is it truncated? ({})", file.written,
           errors.text());
    for (std::size_t i = 0; i < columns; ++i)
      southwards[i] = has_nodata != FALSE && southwards[i] == nodata
                          ? std::numeric_limits<double>::quiet_NaN()
                          : southwards[i] * metres.scale + metres.offset;
  }
  return grid;
}

}  // namespace terracast::tiler
