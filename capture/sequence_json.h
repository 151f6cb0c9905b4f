#pragma once

#include <string>

#include "capture/frame.h"
#include "core/error.h"
#include "core/json.h"

/// sequence.json. Reading checks every value, and that the file is what was written, by the
/// content_hash that it carries.
namespace terracast::capture {

/// Whether a sequence can be held: names that are safe as folders, cameras that can be made, counts
/// in range.
/// kind     of the error thrown
/// where    begins its message
void check_sequence(const SequenceInfo& info, core::ErrorKind kind, const std::string& where);

core::Json json_from_sequence(const SequenceInfo& info);
/// {"cell_px", "finest_spacing_m", "tiles": ["level/x/y hash", …]}, for exports; a capture's has the
/// tiles' heights beside it.
core::Json json_from_geometry(const ShownGeometry& geometry);

/// throws Input: a member is missing or has an impossible value, the file is not as it was written;
///        `file` names it
SequenceInfo sequence_from_json(const core::Json& json, const std::string& file);

}  // namespace terracast::capture
