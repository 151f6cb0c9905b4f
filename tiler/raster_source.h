#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/schema.h"
#include "geo/geodesy.h"
#include "tiler/grid.h"
#include "tiler/world_options.h"

namespace terracast::tiler {

/// A window of a raster's samples.
struct SampleWindow {
  int first_column = 0;
  int first_row = 0;
  int width = 0;
  int height = 0;
  bool is_empty() const { return width <= 0 || height <= 0; }
  std::int64_t num_samples() const { return std::int64_t{width} * height; }
};

/// A raster of heights, opened by GDAL. Its samples stand at the centres of its pixels: sample (i,
/// j) at pixel (i + 0.5, j + 0.5) of GDAL's geotransform, whatever AREA_OR_POINT says (GDAL has
/// shifted such files already).
///
/// threads   the transformations are safe; read() is for one thread at a time
class RasterSource {
 public:
  /// near     longitudes are counted so that they run on without a jump round this place
  /// throws   Io: no such file; Input: cannot be opened, no georeference, no CRS, not one band of
  ///          numbers, an unknown unit
  static std::unique_ptr<RasterSource> open(const core::Path& file, const ElevationOptions& options,
                                            const geo::Geodetic& near);
  virtual ~RasterSource() = default;

  virtual const std::string& path() const = 0;
  virtual const std::string& crs_name() const = 0;
  /// The PROJ pipeline from WGS84 longitude and latitude to the CRS; empty where nothing is to do.
  virtual const std::string& pipeline() const = 0;
  /// Says so when only a ballpark transformation leads to the CRS; empty otherwise.
  virtual const std::string& warning() const = 0;
  virtual int width() const = 0;
  virtual int height() const = 0;

  /// Sample coordinates of places, and places (height 0) of sample coordinates.
  /// throws   Input: a place that the projection cannot hold
  virtual void samples_from_geodetic(std::span<const geo::Geodetic> places,
                                     std::span<Eigen::Vector2d> samples) const = 0;
  virtual void geodetic_from_samples(std::span<const Eigen::Vector2d> samples,
                                     std::span<geo::Geodetic> places) const = 0;

  /// Where sample (0, 0) of `other` stands among this one's samples, when it has the same CRS and
  /// its samples fall on this one's.
  virtual std::optional<Eigen::Vector2i> offset_of(const RasterSource& other) const = 0;

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
