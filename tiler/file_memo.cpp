#include "tiler/file_memo.h"

#include <sys/stat.h>

#include <chrono>

namespace terracast::tiler {

std::optional<FileIdentity> identity_of(const std::string& path) {
  struct stat status = {};
  if (stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
  constexpr std::int64_t kSettled_ns = 2'000'000'000;
  const std::int64_t modified_ns =
      std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::int64_t age_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(now).count() - modified_ns;
  if (age_ns < kSettled_ns) return std::nullopt;
  return FileIdentity{status.st_dev, status.st_ino, status.st_size, modified_ns};
}

}  // namespace terracast::tiler
