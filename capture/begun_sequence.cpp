#include "capture/begun_sequence.h"

#include <algorithm>

#include "capture/file_check.h"
#include "capture/frame_record_json.h"
#include "capture/sequence_files.h"
#include "capture/sequence_json.h"
#include "capture/tracks_json.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"

namespace terracast::capture {

namespace fs = std::filesystem;
using core::ErrorKind;

namespace {

/// Whether a writer of the same inputs has written what all its frames share.
bool is_begun(const fs::path& folder, const SequenceInfo& info) {
  const fs::path sequence_file = folder / kSequenceFile;
  const fs::path tracks_file = folder / kTracksFile;
  return fs::exists(sequence_file) && fs::exists(tracks_file) && !is_damaged(tracks_file) &&
         core::read_text_file(sequence_file) == json_from_sequence(info).text() + "\n";
}

}  // namespace

std::optional<std::string> captured_config(const fs::path& folder) {
  const fs::path file = folder / kSequenceFile;
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::nullopt;
  try {
    return core::Json::read(file).at("config_toml").string();
  } catch (const core::Error&) {
    return std::nullopt;
  }
}

bool is_finished(const fs::path& folder, const SequenceInfo& info, int index) {
  const fs::path file = folder / record_path(index);
  if (!fs::exists(file)) return false;
  try {
    const FrameRecord record = record_from_json(core::Json::read(file), info, file.string());
    if (record.index != index) return false;
    for (const FrameFile* part : record.files())
      if (!has_size(folder, *part)) return false;
    return true;
  } catch (const core::Error& error) {
    // A damaged record is an unfinished frame: it is rendered again.
    if (error.kind() == ErrorKind::Input) return false;
    throw;
  }
}

std::optional<std::vector<TrackPoint>> tracks_of_begun(const fs::path& folder,
                                                       const SequenceInfo& info) {
  if (!is_begun(folder, info)) return std::nullopt;
  const fs::path file = folder / kTracksFile;
  try {
    return tracks_from_json(core::Json::read(file), file.string());
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Input) return std::nullopt;
    throw;
  }
}

bool waits_for_others(const fs::path& folder, const SequenceInfo& info,
                      const FrameSelection& selection) {
  if (!is_begun(folder, info)) return false;
  const std::vector<int> frames = selection.frames_of(info.num_frames);
  if (!std::all_of(frames.begin(), frames.end(),
                   [&](int frame) { return is_finished(folder, info, frame); }))
    return false;
  for (int frame = 0; frame < info.num_frames; ++frame)
    if (!is_finished(folder, info, frame)) return true;
  return false;  // nothing but the manifest is missing
}

}  // namespace terracast::capture
