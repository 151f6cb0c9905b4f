#pragma once

#include <filesystem>

#include "core/json.h"

namespace terracast::labels {

/// Whether labels of one file are there already: its record says all that is wanted, and the file is as the record's
/// xxh3_128 says. What is damaged is not there.
/// throws   Io
bool is_label_finished(const std::filesystem::path& record, const std::filesystem::path& file,
                       const core::Json& wanted);

}  // namespace terracast::labels
