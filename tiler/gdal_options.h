#pragma once

#include <string>

namespace terracast::tiler {

/// Tells GDAL what we want of those of its options that decide what files mean; variables of the environment of those
/// names count no more.
void state_gdal_options();

/// What files mean depends on it beside their bytes: the releases of GDAL and PROJ, and state_gdal_options(). For hashes.
const std::string& gdal_identity();

}  // namespace terracast::tiler
