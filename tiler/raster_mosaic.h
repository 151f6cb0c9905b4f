#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tiler/elevation_registry.h"
#include "tiler/grid.h"
#include "tiler/raster_source.h"
#include "world/tile_store.h"

namespace terracast::tiler {

/// Rasters on one grid, that of the first: samples of rasters on the same grid are taken as they
/// are, those of others are resampled, before anything is interpolated. Voids are filled, and every
/// sample has a height.
struct RasterMosaic {
  std::unique_ptr<RasterSource> first;  ///< whose CRS and grid the mosaic has
  Eigen::Vector2i first_sample;         ///< of the mosaic, among the first raster's
  geo::VerticalDatum datum;
  Grid<double> heights_m;     ///< above the datum
  Grid<std::uint8_t> source;  ///< row of sources
  Grid<std::uint8_t> is_sea;
  Grid<float> floor_depth_m;    ///< of the sea's floor below heights_m; empty where there is none
  Grid<std::uint8_t> is_shelf;  ///< sea whose floor no raster knows; empty where there is none
  bool has_sea = false;
  /// A patch: samples that no raster covers; empty otherwise.
  Grid<std::uint8_t> is_missing;
  Eigen::Vector2d sample_size_m;  ///< on the ground, along a row and along a column
  std::vector<world::SourceInfo>
      sources;  ///< the rasters in order, then filled void, sea, extended where there are such
  std::vector<std::optional<world::RasterInfo>> rasters;  ///< of the first sources
  std::string input_hash;
};

/// What a mosaic is made of, and how far it reaches.
struct MosaicPart {
  std::span<const ElevationOptions> entries;
  /// Covers what its rasters cover of the square, and no more; otherwise all of it and a margin.
  bool is_patch = false;
};

/// throws   Io, Input: as RasterSource; parts of the square without cover while outside = "error"
///          (names the area); no height at all in the square; more samples than fit
RasterMosaic make_mosaic(const ElevationInputs& inputs, const MosaicPart& part);

}  // namespace terracast::tiler
