#pragma once

#include <cstddef>
#include <vector>

#include "core/json.h"
#include "core/schema.h"

namespace terracast::tiler {

/// What a reader of kind "raster" or "features" is told.
core::Json apart_request(const core::Path& file);
core::Path file_of_request(const core::Json& request);

/// Readers behind given_raster() and given_features(), for a process of core::read_apart(): a RasterForm or a FeatureForm,
/// whose samples or features go to the file beside it.
std::vector<std::byte> read_raster_request(const core::Json& request);
std::vector<std::byte> read_features_request(const core::Json& request);

}  // namespace terracast::tiler
