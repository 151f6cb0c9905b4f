#pragma once

#include <filesystem>

#include "core/log.h"
#include "labels/label.h"

namespace terracast::labels {

/// Removes from a folder of labels all that is not of them, and folders that hold nothing then; the log is told how
/// many files. Names that begin with a dot stay, which other writers may be at; links are removed, never followed.
/// throws   Io: what cannot be listed or removed
void remove_stale_files(const std::filesystem::path& folder, const LabelFiles& files,
                        const core::Log& log);

}  // namespace terracast::labels
