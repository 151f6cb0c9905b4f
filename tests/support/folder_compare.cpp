#include "tests/support/folder_compare.h"

#include <fstream>
#include <iterator>
#include <set>

namespace terracast::test {

std::map<std::string, std::string> folder_bytes(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    files[std::filesystem::relative(entry.path(), folder).string()] =
        std::string(std::istreambuf_iterator<char>(stream), {});
  }
  return files;
}

std::string first_difference(const std::filesystem::path& a, const std::filesystem::path& b) {
  const auto files_a = folder_bytes(a);
  const auto files_b = folder_bytes(b);
  for (const auto& [name, bytes] : files_a) {
    const auto found = files_b.find(name);
    if (found == files_b.end()) return name + " is only in " + a.string();
    if (found->second != bytes) return name + " differs";
  }
  for (const auto& [name, bytes] : files_b)
    if (!files_a.contains(name)) return name + " is only in " + b.string();
  return files_a.empty() ? "both folders are empty" : "";
}

}  // namespace terracast::test
