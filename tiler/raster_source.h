#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "core/ledger.h"
#include "core/schema.h"
#include "geo/geodesy.h"
#include "tiler/grid.h"
#include "tiler/raster_grid.h"
#include "tiler/world_options.h"

namespace terracast::tiler {

/// What a raster's samples measure, where they are not heights.
struct RasterQuantity {
  std::string name;  ///< for messages, such as "aridity index"
  double lowest = 0.0;
  double highest = 0.0;
  std::string advice;  ///< for the message on samples outside this range; names no config key
};

/// A raster of heights (or of another quantity), opened by GDAL.
///
/// threads   grid() is safe; read() is for one thread at a time
class RasterSource {
 public:
  /// The most samples of a window that fit into memory.
  static constexpr std::int64_t kMostSamples = 200'000'000;

  /// near     longitudes are counted so that they run on without a jump round this place
  /// throws   Io: no such file; Input: cannot be opened, no georeference, no CRS, not one band of
  ///          numbers, an unknown unit, a unit or vertical datum that contradicts the stated one
  static std::unique_ptr<RasterSource> open(const core::Path& file, const ElevationOptions& options,
                                            const geo::Geodetic& near);
  /// A raster of another quantity, in the file's scale and offset; units that it declares are not read.
  /// throws   as open()
  static std::unique_ptr<RasterSource> open_quantity(const core::Path& file,
                                                     const RasterQuantity& quantity,
                                                     const geo::Geodetic& near);
  virtual ~RasterSource() = default;

  virtual const std::string& path() const = 0;
  virtual const RasterGrid& grid() const = 0;

  /// Heights in metres above the stated datum, or values of the quantity; NaN where there is none:
  /// where samples are NaN, of a no-data value, or masked.
  /// window   within the raster; of one that goes round the Earth columns may lie beyond it
  /// throws   Input: cannot be read (truncated), a height that no ground on Earth has, its seas' floors too, or a
  ///          value outside the quantity's range (names the pixel)
  virtual Grid<double> read(const SampleWindow& window) const = 0;

  /// The height or value that a stored number stands for, and the other way round.
  virtual double metres_of(double raw) const = 0;
  virtual double raw_of(double value) const = 0;

  /// What the file says beside its samples.
  virtual core::Ledger ledger() const = 0;

  /// Of the four corners' samples; NaN where there is none.
  virtual std::array<double, 4> corner_heights_m() const = 0;

  /// Of the file's bytes (where it is a plain file) and of all that says what its samples mean:
  /// CRS, geotransform, unit, scale, offset, no-data value.
  virtual std::string content_hash() const = 0;
};

}  // namespace terracast::tiler
