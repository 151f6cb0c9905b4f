#pragma once

#include <string_view>

#include "core/schema.h"
#include "tiler/feature_source.h"
#include "tiler/surveyed_ground.h"

namespace terracast::tiler {

/// Tag of an outline from a raster: the median of its cells' heights above the ground, m.
inline constexpr std::string_view kMedianHeight = "terracast:median_height";

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

/// Buildings without footprints: outlines of what a raster of heights shows to stand above the ground
/// (find_blocks(), outlines_of()), numbered by cell_number(), tagged building=yes, with kMedianHeight, and roof:shape=flat where nine tenths of its cells
/// lie within a metre.
/// accuracy   a straight wall lies within straighten_cells of the middles of the sides of its cells, a corner within 1.5 cells of theirs;
///            areas of drawn blocks to 0.1 % along the cells, 2 % aslant (Blocks.ComeBack…)
/// throws     as read_height_cells(); Input: more than 2 million outlines
FeatureSet read_raster_outlines(const HeightFiles& files, const RasterOutlineOptions& options,
                                const LayerInputs& inputs);

/// The outlines, and round what the raster knows the height of.
SurveyedGround survey_of_raster(const HeightFiles& files, const RasterOutlineOptions& options,
                                const LayerInputs& inputs);

}  // namespace terracast::tiler
