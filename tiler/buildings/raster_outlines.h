#pragma once

#include <string>

#include "core/schema.h"
#include "tiler/buildings/town.h"
#include "tiler/feature_source.h"
#include "tiler/surveyed_ground.h"

namespace terracast::tiler {

/// Config keys of outlines from a raster of heights.
struct RasterOutlineOptions {
  double least_height_m = 2.5;
  double least_area_m2 = 25.0;
  double height_class_m = 4.0;
  double straighten_cells = 0.9;

  void describe(core::SchemaVisitor& visit);
};

/// A raster of heights, and how it is read: as HeightRaster::open().
struct HeightFiles {
  core::Path surface;
  core::Path terrain;  ///< empty: surface holds heights above the ground
  std::string nodata;
};

/// What a raster of heights shows to stand above the ground, where there are no footprints.
struct RasterOutlines {
  FeatureSet features;
  MeasuredHeights medians_m;  ///< of each feature's cells
  SurveyedGround ground;      ///< the outer rings, and the cells whose height is known
};

/// Outlines of blocks (find_blocks(), outlines_of()), numbered by cell_number(), tagged
/// building=yes, and roof:shape=flat where nine tenths of their cells lie within a metre. Ground is
/// surveyed where the raster has a height, cell by cell; only where that takes more than 100 000
/// boxes, less of it is (boxes_of_known()).
/// accuracy   a straight wall lies within straighten_cells of the middles of the sides of its
///            cells, a corner within 1.5 cells of theirs; areas of drawn blocks to 0.1 % along the
///            cells, 2 % aslant (Blocks.ComeBack…)
/// throws     as read_height_cells(); Input: more than 2 million outlines
RasterOutlines read_raster_outlines(const HeightFiles& files, const RasterOutlineOptions& options,
                                    const LayerInputs& inputs);

}  // namespace terracast::tiler
