#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "tiler/grid.h"
#include "tiler/raster_mosaic.h"
#include "tiler/raster_source.h"

namespace terracast::tiler {

constexpr std::uint8_t kNoSource = std::numeric_limits<std::uint8_t>::max();

/// A mosaic in the making: what its steps (reading rasters, filling gaps, finding the sea) share.
struct MosaicDraft {
  const ElevationInputs& inputs;
  const MosaicPart& part;
  const double half_size_m = inputs.options.size_m / 2.0;

  struct Raster {
    std::unique_ptr<RasterSource> source;
    geo::VerticalDatum datum;
    const ElevationOptions* entry;
  };
  std::vector<Raster> rasters{};  ///< in the order of mosaic.sources, which begin with them

  RasterMosaic mosaic{};            ///< heights are NaN where source is kNoSource
  Grid<std::uint8_t> covered_by{};  ///< the first raster whose extent holds the sample
  /// Samples as low as the sea of their own raster, in its datum, when it has such a sea.
  Grid<std::uint8_t> is_low{};

  SampleSize sample{};  ///< of the mosaic

  /// At the world's origin.
  SampleSize size_of_samples(const RasterGrid& grid) const {
    return grid.size_of_samples(inputs.frame, half_size_m);
  }
  std::vector<geo::Geodetic> places_of_row(int row) const;
  /// What is added to heights above a datum to have them above the mosaic's.
  double shift_m(const geo::VerticalDatum& from, const geo::Geodetic& place) const;
  /// The row of mosaic.sources for what comes from no raster; added at the first call.
  std::uint8_t source_row(const std::string& kind, const std::string& name);
  [[noreturn]] void fail_without_heights() const;
};

}  // namespace terracast::tiler
