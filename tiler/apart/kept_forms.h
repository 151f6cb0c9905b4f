#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "core/reading_apart.h"
#include "core/schema.h"
#include "tiler/apart/crs_form.h"

namespace terracast::tiler {

inline constexpr std::uint64_t kMostFormBytes = std::uint64_t{256} << 20;

/// Limits of a process that unpacks a file.
inline core::ReadingLimits limits_of_apart(std::uint64_t file_bytes) {
  return {.cpu_s = 3000.0, .file_bytes = file_bytes};
}

/// Sizes and times of a file, of those beside it of the same name with another ending, and of further ones: changed when
/// one of them is. A folder's are those of what is in it.
std::string state_of_files(const core::Path& file, const FileNames& further);

/// What was read apart of files, each once.
/// Kept    has form.files
/// threads safe; those that want one file wait for the first
template <class Kept>
class KeptForms {
 public:
  /// read   throws: nothing is kept
  template <class Read>
  std::shared_ptr<const Kept> get(const core::Path& file, const Read& read) {
    Entry& entry = entry_of(file);
    const std::lock_guard lock(entry.mutex);
    if (!entry.kept || entry.state != state_of_files(file, entry.kept->form.files)) {
      entry.kept.reset();
      const std::string before = state_of_files(file, {});
      std::shared_ptr<const Kept> kept = read();
      if (state_of_files(file, {}) != before) return kept;  // written meanwhile
      entry.state = state_of_files(file, kept->form.files);
      entry.kept = std::move(kept);
    }
    return entry.kept;
  }

 private:
  struct Entry {
    std::mutex mutex;
    std::string state;
    std::shared_ptr<const Kept> kept;
  };

  Entry& entry_of(const core::Path& file) {
    const std::lock_guard lock(mutex_);
    return entries_[{file.written, file.resolved.string()}];
  }

  std::mutex mutex_;
  std::map<std::pair<std::string, std::string>, Entry> entries_;
};

}  // namespace terracast::tiler
