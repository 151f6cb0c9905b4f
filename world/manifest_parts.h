#pragma once

#include "core/json.h"
#include "world/imagery_info.h"
#include "world/volume_info.h"

namespace terracast::world {

/// Parts of a world's manifest as JSON and back.
/// throws   Input: members that are missing or out of bounds
core::Json json_of(const ImageryInfo& imagery);
ImageryInfo imagery_of(const core::Json& json);
core::Json json_of(const VolumeInfo& volume);
VolumeInfo volume_of(const core::Json& json);
core::Json json_of(const VolumePlace& place);
VolumePlace volume_place_of(const core::Json& json);

}  // namespace terracast::world
