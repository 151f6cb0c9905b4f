#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

/// Work in steps that takes long and may be cut off at any moment.
namespace terracast::validate {

/// A folder of finished steps. Each is a folder that holds the hash of all that it was made from,
/// written before the folder gets its name: it is there whole or not at all. A step whose hash is
/// another one is made again.
class WorkFolder {
 public:
  /// throws  Io
  explicit WorkFolder(std::filesystem::path folder);

  const std::filesystem::path& path() const { return folder_; }

  /// The finished step `name`.
  /// key   all that it is made from
  /// make  fills the folder that it is given
  /// throws  what `make` throws; Io
  std::filesystem::path made(
      const std::string& name, std::string_view key,
      const std::function<void(const std::filesystem::path& folder)>& make) const;

  /// One step of a chain.
  struct Step {
    std::string key;  ///< of this step alone
    std::function<void(const std::filesystem::path& folder)> grow;
  };
  /// A folder that grows step by step, each from a copy of what the step before it left. Only the
  /// newest is kept, so that a chain that was cut off goes on with the step that was cut.
  std::filesystem::path grown(const std::string& name, const std::vector<Step>& steps) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace terracast::validate
