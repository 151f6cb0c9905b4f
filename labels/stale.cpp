#include "labels/stale.h"

#include <system_error>
#include <vector>

#include "core/error.h"

namespace terracast::labels {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// What stands below a folder, folders before what they hold.
std::vector<fs::path> entries_below(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::none, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error))
    entries.push_back(entry->path());
  if (error) fail(ErrorKind::Io, "{}: cannot be listed: {}", folder.string(), error.message());
  return entries;
}

bool is_folder(const fs::path& path) {
  std::error_code error;  // then it is none
  return fs::symlink_status(path, error).type() == fs::file_type::directory;
}

}  // namespace

void remove_stale_files(const fs::path& folder, const LabelFiles& files, const core::Log& log) {
  if (!is_folder(folder)) return;
  const std::vector<fs::path> entries = entries_below(folder);
  std::size_t num_removed = 0;
  for (const fs::path& path : entries) {
    if (is_folder(path) || path.filename().string().starts_with('.') ||
        files.contains(path.lexically_relative(folder)))
      continue;
    std::error_code error;
    num_removed += fs::remove(path, error) ? 1 : 0;
    if (error) fail(ErrorKind::Io, "{}: cannot be removed: {}", path.string(), error.message());
  }
  // The deepest first. One that another run writes into at this moment is not empty, and stays.
  for (auto path = entries.rbegin(); path != entries.rend(); ++path) {
    std::error_code not_empty;
    if (is_folder(*path)) fs::remove(*path, not_empty);
  }
  if (num_removed > 0)
    log.info("{}: {} files of other labels than are asked for now are removed", folder.string(),
             num_removed);
}

}  // namespace terracast::labels
