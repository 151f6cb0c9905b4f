#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace terracast::test {

/// Every file below a folder with its bytes, by relative path.
std::map<std::string, std::string> folder_bytes(const std::filesystem::path& folder);

/// The first difference between two folders in words; empty when they hold the same files with the
/// same bytes.
std::string first_difference(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace terracast::test
