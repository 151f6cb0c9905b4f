#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"

/// Reads the files of a sequence whose capture has begun, finished or not.
namespace terracast::capture {

/// The config of the sequence in a folder, as it was captured. nullopt: there is no sequence, or it is damaged.
std::optional<std::string> captured_config(const std::filesystem::path& folder);

/// Whether a frame's record exists and its files have the recorded sizes.
/// info     of the sequence in the folder
bool is_finished(const std::filesystem::path& folder, const SequenceInfo& info, int frame);

/// The track points of a sequence that a SequenceWriter of the same inputs has begun in a folder. nullopt: none has,
/// or its files are damaged.
/// throws    Io
std::optional<std::vector<TrackPoint>> tracks_of_begun(const std::filesystem::path& folder,
                                                       const SequenceInfo& info);

/// Whether the frames of a selection are finished, and frames of other runs are missing yet, so that there is no
/// manifest to be written either.
/// throws    Io
bool waits_for_others(const std::filesystem::path& folder, const SequenceInfo& info,
                      const FrameSelection& selection);

}  // namespace terracast::capture
