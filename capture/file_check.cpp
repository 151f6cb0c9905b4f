#include "capture/file_check.h"

#include <system_error>

#include "core/hash.h"

namespace terracast::capture {

namespace fs = std::filesystem;

bool has_size(const fs::path& folder, const FrameFile& entry) {
  std::error_code missing;
  const std::uintmax_t size = fs::file_size(folder / entry.path, missing);
  return !missing && size == entry.num_bytes;
}

bool is_whole(const fs::path& folder, const FrameFile& entry) {
  return has_size(folder, entry) &&
         core::content_hash_of_file(folder / entry.path) == entry.content_hash;
}

}  // namespace terracast::capture
