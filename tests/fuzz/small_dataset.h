#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace terracast::fuzz {

/// A dataset of a format as it is exported, of two frames of a small capture, in a scratch folder.
class SmallDataset {
 public:
  /// format   name of an exporter
  explicit SmallDataset(const std::string& format);

  const std::filesystem::path& folder() const { return folder_; }
  /// By their paths in the folder.
  const std::map<std::string, std::vector<std::byte>, std::less<>>& files() const { return files_; }

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::vector<std::byte>, std::less<>> files_;
};

}  // namespace terracast::fuzz
