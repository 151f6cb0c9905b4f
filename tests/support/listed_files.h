#pragma once

#include <filesystem>

namespace terracast::test {

/// Writes the list of files in dataset.json anew, with their sizes and hashes as they are.
void list_files_again(const std::filesystem::path& folder);

}  // namespace terracast::test
