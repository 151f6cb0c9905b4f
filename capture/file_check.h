#pragma once

#include <filesystem>

#include "capture/frame.h"

namespace terracast::capture {

/// Whether a sequence's file is there with the size that its entry says.
bool has_size(const std::filesystem::path& folder, const FrameFile& entry);

/// The same of its content, by the hash.
/// cost     reads the file once
/// throws   Io
bool is_whole(const std::filesystem::path& folder, const FrameFile& entry);

/// Whether a JSON file of this version is not as it was written.
/// throws   Io
bool is_damaged(const std::filesystem::path& file);

}  // namespace terracast::capture
