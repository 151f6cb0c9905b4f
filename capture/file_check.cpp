#include "capture/file_check.h"

#include <system_error>

#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"

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

bool is_damaged(const fs::path& file) {
  try {
    const core::Json json = core::Json::read(file);
    const bool is_of_other_version =
        json.has("version") && json.at("version").integer() != kCaptureVersion;
    if (!is_of_other_version) core::check_content_hash(json);
    return false;
  } catch (const core::Error& error) {
    if (error.kind() == core::ErrorKind::Input) return true;
    throw;
  }
}

}  // namespace terracast::capture
