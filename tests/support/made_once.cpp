#include "tests/support/made_once.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <vector>

#include "core/atomic_file.h"
#include "core/hash.h"

namespace terracast::test {

namespace fs = std::filesystem;

namespace {

/// Held by one process at a time; released by the system when the process ends, however it ends.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& file)
      : descriptor_(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
    if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX) != 0)
      throw std::runtime_error("cannot lock " + file.string());
  }
  ~FolderLock() { ::close(descriptor_); }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

/// A line for each file: its size and when it was written.
std::string listing(const fs::path& folder) {
  std::vector<std::string> lines;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    lines.push_back(fmt::format("{} {} {}\n", entry.path().lexically_relative(folder).string(),
                                entry.file_size(),
                                entry.last_write_time().time_since_epoch().count()));
  }
  std::sort(lines.begin(), lines.end());
  return fmt::format("{}", fmt::join(lines, ""));
}

/// The first line that one of two listings has and the other has not.
std::string changed_line(const std::string& before, const std::string& now) {
  const auto [a, b] = std::mismatch(before.begin(), before.end(), now.begin(), now.end());
  const auto& [text, at] =
      b != now.end() ? std::pair(&now, b - now.begin()) : std::pair(&before, a - before.begin());
  const std::size_t start = text->rfind('\n', static_cast<std::size_t>(at)) + 1;
  return text->substr(start, text->find('\n', start) - start);
}

}  // namespace

fs::path made_once(const std::string& name, const std::string& inputs,
                   const std::function<void(const fs::path&)>& make) {
  const fs::path root = TERRACAST_MADE_ONCE;
  fs::create_directories(root);
  const FolderLock lock(root / (name + ".lock"));
  const fs::path folder = root / name, list = root / (name + ".files"),
                 key = root / (name + ".key");
  const std::string wanted = core::content_hash(fmt::format(
      "{}\n{}\n{}", core::content_hash_of_file(TERRACAST_PROGRAM),
      core::content_hash_of_file(TERRACAST_PROGRAM "_program"), inputs));  // which it starts
  if (fs::exists(key) && core::read_text_file(key) == wanted) {
    const std::string before = core::read_text_file(list), now = listing(folder);
    if (before == now) return folder;
    fs::remove(key);
    throw std::logic_error("a test has changed what all share: " +
                           (folder / changed_line(before, now)).string());
  }
  // Without its key the folder counts as unfinished, whatever ends this process.
  fs::remove(key);
  fs::remove_all(folder);
  fs::create_directories(folder);
  make(folder);
  if (!testing::Test::HasFailure()) {
    core::write_file(list, listing(folder));
    core::write_file(key, wanted);
  }
  return folder;
}

}  // namespace terracast::test
