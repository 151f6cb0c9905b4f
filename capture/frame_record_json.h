#pragma once

#include <string>

#include "capture/frame.h"
#include "core/error.h"
#include "core/json.h"

/// frames/NNNNNN.json. Reading checks every value, and that the file is what was written, by the
/// content_hash that it carries.
namespace terracast::capture {

/// Whether a record belongs to a sequence: index, cameras, file names, values.
void check_record(const FrameRecord& record, const SequenceInfo& info, core::ErrorKind kind,
                  const std::string& where);

/// input_hash   of its sequence: a record is trusted by itself, whatever became of sequence.json
core::Json json_from_record(const FrameRecord& record, const std::string& input_hash);

/// throws Input: a member is missing or has an impossible value, the file is not as it was written,
///        the record is of a sequence of other inputs; `file` names it
FrameRecord record_from_json(const core::Json& json, const SequenceInfo& info,
                             const std::string& file);

}  // namespace terracast::capture
