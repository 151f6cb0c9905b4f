#pragma once

#include <string>
#include <vector>

#include "capture/frame.h"
#include "core/json.h"

/// tracks.json. Reading checks every value, and that the file is what was written, by the
/// content_hash that it carries.
namespace terracast::capture {

core::Json json_from_tracks(const std::vector<TrackPoint>& tracks);

/// throws Input: a member is missing or has an impossible value, the file is not as it was written;
///        `file` names it
std::vector<TrackPoint> tracks_from_json(const core::Json& json, const std::string& file);

}  // namespace terracast::capture
