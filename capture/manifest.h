#pragma once

#include <string>
#include <vector>

#include "capture/frame.h"
#include "core/json.h"

namespace terracast::capture {

/// manifest.json: the hash of every JSON file and the sums over all frames.
struct Manifest {
  std::string input_hash;
  std::vector<FrameFile> files;  ///< sequence.json, tracks.json, then the records in order
  bool operator==(const Manifest&) const = default;
};
/// records   all, in order: their pixel counts are summed for each camera
core::Json json_from_manifest(const Manifest& manifest, const SequenceInfo& info,
                              const std::vector<FrameRecord>& records);
/// throws Input: a member is missing or has an impossible value, the file is not as it was written,
///        it is of a sequence of other inputs; `file` names it
Manifest manifest_from_json(const core::Json& json, const SequenceInfo& info,
                            const std::string& file);

}  // namespace terracast::capture
