#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace terracast::tiler {

/// Which file a path leads to, and as of when: another of any member is another file, or one that was changed.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  off_t size_bytes = 0;
  std::int64_t modified_ns = 0;
  bool operator==(const FileIdentity&) const = default;
};

/// nullopt: it is no regular file (a member of an archive, say), or was changed in the last two seconds, so that it may
/// change again within one step of the file system's clock.
std::optional<FileIdentity> identity_of(const std::string& path);

/// What was found in files, kept for as long as they stay as they are.
/// threads   safe; who comes for a file waits while anything is found
template <class Value>
class FileMemo {
 public:
  /// What `find` gives, which is called where it is not known yet. What it throws is thrown, and nothing kept.
  template <class Find>
  Value of(const std::string& path, const Find& find) {
    const std::lock_guard lock(mutex_);
    const std::optional<FileIdentity> identity = identity_of(path);
    const auto known = known_.find(path);
    if (identity && known != known_.end() && known->second.first == *identity)
      return known->second.second;
    Value value = find();
    if (identity && identity_of(path) == identity) {
      if (known_.size() >= kMost) known_.clear();
      known_.insert_or_assign(path, std::pair(*identity, value));
    }
    return value;
  }

 private:
  static constexpr std::size_t kMost = 4096;
  std::mutex mutex_;
  std::map<std::string, std::pair<FileIdentity, Value>> known_;
};

}  // namespace terracast::tiler
