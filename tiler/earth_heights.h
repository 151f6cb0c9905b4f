#pragma once

#include <string>
#include <string_view>

#include "tiler/grid.h"
#include "tiler/raster_source.h"

namespace terracast::tiler {

/// The range of heights above the sea that ground on Earth has.
/// Shore of the Dead Sea: 430 m below the sea in 2016, and a metre deeper each year (Israel Oceanographic and
/// Limnological Research). Everest: 8848.86 m (surveys of Nepal and China, 2020). Challenger Deep: 10 935 m (Greenaway
/// and others, 2021, Deep-Sea Research I 178).
inline constexpr double kLowestShore_m = -430.0;
inline constexpr double kHighestPeak_m = 8848.86;
inline constexpr double kDeepestFloor_m = -10935.0;
/// For what is dug and heaped up, for undulations of geoids (up to 107 m), and errors of measurement.
inline constexpr double kEarthMargin_m = 500.0;

/// Refuses samples of a fill that stands for no height in many files (-9999; others lie beyond all heights).
/// heights_m   a window of the raster
/// nodata      as the config states it, in its key `key`
/// throws      Input: there are such, and nothing declares them
void refuse_undeclared_fills(const RasterSource& raster, const Grid<double>& heights_m,
                             const std::string& nodata, std::string_view key = "nodata");

/// Refuses ground that lies nowhere on Earth: beyond its range by more than kEarthMargin_m.
/// entry    whether it holds floors of seas is in its key `sea`
/// window   that heights_m are of
/// throws   Input: one sample does (names it)
void refuse_ground_beyond_earth(const RasterSource& raster, const ElevationOptions& entry,
                                const SampleWindow& window, const Grid<double>& heights_m);

}  // namespace terracast::tiler
