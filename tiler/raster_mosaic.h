#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "tiler/grid.h"
#include "tiler/layer_registry.h"
#include "tiler/raster_source.h"
#include "world/tile_store.h"

namespace terracast::tiler {

/// All rasters of a world on one grid, that of the first: samples of rasters on the same grid are
/// taken as they are, those of others are resampled, before anything is interpolated. Covers the
/// world's square and a margin; voids are filled, and every sample has a height.
struct RasterMosaic {
  std::unique_ptr<RasterSource> first;  ///< whose CRS and grid the mosaic has
  Eigen::Vector2i first_sample;         ///< of the mosaic, among the first raster's
  Grid<double> heights_m;               ///< above the first raster's datum
  Grid<std::uint8_t> source;            ///< row of sources
  Grid<std::uint8_t> is_sea;
  bool has_sea = false;
  std::vector<world::SourceInfo>
      sources;  ///< the rasters in order, then filled void, sea, extended where there are such
  std::string input_hash;
};

/// throws   Io, Input: as RasterSource; parts of the square without cover while outside = "error"
///          (names the area); no height at all in the square; more samples than fit
RasterMosaic make_mosaic(const ElevationInputs& inputs);

}  // namespace terracast::tiler
