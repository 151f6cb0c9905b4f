#pragma once

#include <gdal_priv.h>

#include <optional>
#include <string>

#include "tiler/crs_operation.h"
#include "tiler/world_options.h"

namespace terracast::tiler {

/// What a raster of heights declares of its unit and vertical datum; empty where it says nothing.
struct HeightClaims {
  std::string band_unit;
  std::string crs_unit;  ///< of the vertical part of its reference system
  std::string
      datum;  ///< its vertical system by name, or the datum by another convention of its format
  bool is_ellipsoidal = false;  ///< of a system of three axes
};

HeightClaims height_claims(GDALDataset& dataset, GDALRasterBand& band, const HorizontalCrs& crs);

/// Metres in a unit of height as files name it; nothing for words that are not known.
std::optional<double> metres_in(std::string unit);

/// Metres in a raster's unit, by what it declares and what the config states.
/// throws   Input: an unknown unit, and none is stated; declared units that contradict each other or the stated one
///          while trust = "agreement" (names both)
double metres_per_unit(const HeightClaims& claims, const ElevationOptions& options,
                       const std::string& written);

/// throws   Input: the declared vertical datum contradicts the stated one while trust = "agreement" (names both)
void check_vertical_datum(const HeightClaims& claims, const ElevationOptions& options,
                          const std::string& written);

}  // namespace terracast::tiler
