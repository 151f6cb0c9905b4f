#pragma once

#include <Eigen/Core>
#include <optional>

#include "world/raster_info.h"

namespace terracast::job {

/// Where a place lies in a raster: column and row, counted from the first pixel's outer corner (pixel (0, 0) from 0
/// to 1), by its PROJ pipeline and its geotransform.
/// accuracy   a place more than 1e-4 px from a side is in the right pixel (against GeographicLib's UTM)
/// throws     Input: a pipeline that PROJ does not know
/// returns    nothing of a place that the projection cannot hold
std::optional<Eigen::Vector2d> pixel_from_geodetic(const world::RasterInfo& raster, double lat_deg,
                                                   double lon_deg);

/// The pixel that holds a place, counted from 0; nothing beyond the raster.
/// throws     as pixel_from_geodetic()
std::optional<Eigen::Vector2i> cell_from_geodetic(const world::RasterInfo& raster, double lat_deg,
                                                  double lon_deg);

}  // namespace terracast::job
