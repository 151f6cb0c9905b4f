#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>

#include "core/schema.h"
#include "geo/geodesy.h"
#include "tiler/grid.h"
#include "tiler/raster_grid.h"
#include "tiler/world_options.h"

namespace terracast::tiler {

/// A raster of heights, opened by GDAL.
///
/// threads   grid() is safe; read() is for one thread at a time
class RasterSource {
 public:
  /// near     longitudes are counted so that they run on without a jump round this place
  /// throws   Io: no such file; Input: cannot be opened, no georeference, no CRS, not one band of
  ///          numbers, an unknown unit
  static std::unique_ptr<RasterSource> open(const core::Path& file, const ElevationOptions& options,
                                            const geo::Geodetic& near);
  virtual ~RasterSource() = default;

  virtual const std::string& path() const = 0;
  virtual const RasterGrid& grid() const = 0;

  /// Heights in metres above the stated datum; NaN where there is none.
  /// window   within the raster
  /// throws   Input: cannot be read (truncated), a NaN that is not declared, a height outside
  ///          -12000 to 9000 m (names the pixel)
  virtual Grid<double> read(const SampleWindow& window) const = 0;

  /// Of the four corners' samples; NaN where there is none.
  virtual std::array<double, 4> corner_heights_m() const = 0;

  /// Of the file's bytes (where it is a plain file) and of all that says what its samples mean:
  /// CRS, geotransform, unit, scale, offset, no-data value.
  virtual std::string content_hash() const = 0;
};

}  // namespace terracast::tiler
