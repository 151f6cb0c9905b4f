#pragma once

#include <string>

namespace terracast::tiler {

/// Whether a raster is of a format that this process reads itself (kTroddenRasters): then so is all that it names, if it
/// is a VRT, and what lies beside it (.msk, .ovr, .aux). No driver of another format is asked.
/// path   as GDAL knows it
bool is_trodden_raster(const std::string& path);

/// Whether features are of a format that this process reads itself (kTroddenVectors).
bool is_trodden_vectors(const std::string& path);

}  // namespace terracast::tiler
