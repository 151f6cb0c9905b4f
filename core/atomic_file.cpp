#include "core/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <optional>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/process_id.h"

namespace terracast::core {

namespace fs = std::filesystem;

namespace {

/// Temporary names are kPrefix + this_process() + random_name() + the final name's extension.
constexpr std::string_view kPrefix = ".terracast-tmp-";
/// A writer on another machine cannot be asked whether it lives; after this long it is taken for
/// dead.
constexpr std::chrono::hours kForeignLifetime{1};

std::string reason(int error_number) {
  return std::error_code(error_number, std::generic_category()).message();
}

class FileDescriptor {
 public:
  explicit FileDescriptor(int value) : value_(value) {}
  ~FileDescriptor() {
    if (value_ >= 0) ::close(value_);
  }
  FileDescriptor(FileDescriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&&) = delete;
  int get() const { return value_; }
  /// Returns 0 or the error number. Network file systems report a full disk only here.
  int close() {
    const int result = ::close(value_) == 0 ? 0 : errno;
    value_ = -1;
    return result;
  }

 private:
  int value_;
};

fs::path temporary_beside(const fs::path& file) {
  return file.parent_path() / fmt::format("{}{}-{}{}", kPrefix, this_process(), random_name(),
                                          file.extension().string());
}

/// Removes the temporary file unless it was renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& file) : file_(file), temporary_(temporary_beside(file)) {}
  ~TemporaryFile() {
    if (!renamed_) ::unlink(temporary_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const fs::path& path() const { return temporary_; }

  void rename() {
    if (::rename(temporary_.c_str(), file_.c_str()) != 0) fail_to_put_in_place();
    renamed_ = true;
    sync_folder();
  }

  /// Puts the file in place unless there is one; says whether it did.
  bool rename_if_new() {
    if (::link(temporary_.c_str(), file_.c_str()) == 0 || has_second_name()) {
      sync_folder();
      return true;
    }
    if (errno == EEXIST) return false;
    // A file system without links, such as FAT.
    if (::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, file_.c_str(), RENAME_NOREPLACE) != 0) {
      if (errno == EEXIST) return false;
      fail_to_put_in_place();
    }
    renamed_ = true;
    sync_folder();
    return true;
  }

 private:
  /// Over NFS a link may be made and its answer lost; the repeated request then fails.
  bool has_second_name() const {
    const int error = errno;
    struct stat status {};
    const bool has = ::stat(temporary_.c_str(), &status) == 0 && status.st_nlink == 2;
    errno = error;
    return has;
  }

  [[noreturn]] void fail_to_put_in_place() const {
    fail(ErrorKind::Io, "{}: cannot be put in place: {}", file_.string(), reason(errno));
  }

  void sync_folder() const {
    const fs::path folder = file_.has_parent_path() ? file_.parent_path() : fs::path(".");
    const FileDescriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    // Some file systems cannot sync a folder; they say EINVAL, and the new name stands.
    if (descriptor.get() < 0 || (::fsync(descriptor.get()) != 0 && errno != EINVAL))
      fail(ErrorKind::Io, "{}: its folder cannot be synced: {}", file_.string(), reason(errno));
  }

  fs::path file_;
  fs::path temporary_;
  bool renamed_ = false;
};

/// Where a write to `file` goes: through links to what they name, and never in the place of a
/// device or pipe. Makes the file's folder.
fs::path target_of(const fs::path& file) {
  if (!file.has_filename()) fail(ErrorKind::Io, "\"{}\" does not name a file", file.string());
  if (file.has_parent_path()) make_folder(file.parent_path());
  constexpr int kMaxLinks = 40;  // as Linux follows
  fs::path target = file;
  std::error_code error;
  for (int i = 0; fs::is_symlink(fs::symlink_status(target, error)); ++i) {
    if (i == kMaxLinks) fail(ErrorKind::Io, "{}: too many links", file.string());
    target = target.parent_path() / fs::read_symlink(target, error);
  }
  const fs::file_status status = fs::status(target, error);
  if (fs::is_other(status))
    fail(ErrorKind::Io, "{}: a device or pipe, which no file can replace; give another name",
         file.string());
  return target;
}

/// Writes and syncs a temporary file that stands for `file`.
void write_temporary(const TemporaryFile& temporary, const fs::path& file,
                     std::span<const std::byte> bytes) {
  FileDescriptor descriptor(
      ::open(temporary.path().c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (descriptor.get() < 0)
    fail(ErrorKind::Io, "{}: cannot be written: {}", file.string(), reason(errno));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::write(descriptor.get(), bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0)
      fail(ErrorKind::Io, "{}: cannot be written after {} of {} bytes: {}", file.string(), done,
           bytes.size(), reason(errno));
    done += static_cast<std::size_t>(count);
  }
  if (::fsync(descriptor.get()) != 0)
    fail(ErrorKind::Io, "{}: cannot be synced: {}", file.string(), reason(errno));
  if (const int error = descriptor.close(); error != 0)
    fail(ErrorKind::Io, "{}: cannot be closed: {}", file.string(), reason(error));
}

}  // namespace

void write_file(const fs::path& file, std::span<const std::byte> bytes) {
  TemporaryFile temporary(target_of(file));
  write_temporary(temporary, file, bytes);
  temporary.rename();
}

void write_file(const fs::path& file, std::string_view text) {
  write_file(file, std::as_bytes(std::span(text)));
}

bool write_new_file(const fs::path& file, std::string_view text) {
  TemporaryFile temporary(target_of(file));
  write_temporary(temporary, file, std::as_bytes(std::span(text)));
  return temporary.rename_if_new();
}

void write_file_by(const fs::path& file, const std::function<void(const fs::path&)>& write) {
  TemporaryFile temporary(target_of(file));
  write(temporary.path());
  {
    FileDescriptor descriptor(::open(temporary.path().c_str(), O_RDONLY | O_CLOEXEC));
    if (descriptor.get() < 0)
      fail(ErrorKind::Io, "{}: its writer left no file: {}", file.string(), reason(errno));
    if (::fsync(descriptor.get()) != 0)
      fail(ErrorKind::Io, "{}: cannot be synced: {}", file.string(), reason(errno));
  }
  temporary.rename();
}

void link_file(const fs::path& from, const fs::path& file) {
  TemporaryFile temporary(target_of(file));
  if (::linkat(AT_FDCWD, from.c_str(), AT_FDCWD, temporary.path().c_str(), AT_SYMLINK_FOLLOW) ==
      0) {
    temporary.rename();
    // Of two links to one file a rename leaves both.
    ::unlink(temporary.path().c_str());
    return;
  }
  write_file_by(file, [&](const fs::path& copy) {
    std::error_code error;
    fs::copy_file(from, copy, error);
    if (error)
      fail(ErrorKind::Io, "{}: cannot be copied to {}: {}", from.string(), file.string(),
           error.message());
  });
}

namespace {

struct OpenFile {
  FileDescriptor descriptor;
  std::size_t stated_bytes = 0;  ///< by the folder; a file of /proc states none
};

/// throws   Io: missing, unreadable, a folder; Input: a device or pipe
OpenFile open_to_read(const fs::path& file) {
  // Without O_NONBLOCK a pipe would be waited for, until somebody writes to it.
  FileDescriptor descriptor(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  if (descriptor.get() < 0)
    fail(ErrorKind::Io, "{}: cannot be read: {}", file.string(), reason(errno));
  struct stat status {};
  if (::fstat(descriptor.get(), &status) != 0)
    fail(ErrorKind::Io, "{}: cannot be read: {}", file.string(), reason(errno));
  if (S_ISDIR(status.st_mode))
    fail(ErrorKind::Io, "{}: is a folder, but must be a file", file.string());
  if (!S_ISREG(status.st_mode))
    fail(ErrorKind::Input, "{}: is a device or pipe, but must be a file", file.string());
  return {std::move(descriptor), static_cast<std::size_t>(std::max<off_t>(status.st_size, 0))};
}

/// The next bytes of a file, at least one of them; 0 at its end.
std::size_t read_some(const FileDescriptor& descriptor, std::span<std::byte> buffer,
                      const fs::path& file) {
  while (true) {
    const ssize_t count = ::read(descriptor.get(), buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(ErrorKind::Io, "{}: cannot be read: {}", file.string(), reason(errno));
    return static_cast<std::size_t>(count);
  }
}

template <class Buffer>
Buffer read_whole(const fs::path& file, std::size_t max_bytes) {
  const auto [descriptor, stated] = open_to_read(file);
  const auto refuse_size = [&] {
    fail(ErrorKind::Input,
         "{}: is larger than {} bytes, and no more is read of such a file; split it, or leave out "
         "what is not needed",
         file.string(), max_bytes);
  };
  if (stated > max_bytes) refuse_size();

  // /proc states no size, and a file may grow: read until the end, whatever was stated.
  Buffer buffer;
  buffer.resize(stated + 1);
  std::size_t done = 0;
  while (true) {
    const std::size_t count =
        read_some(descriptor, std::as_writable_bytes(std::span(buffer)).subspan(done), file);
    if (count == 0) break;
    done += count;
    if (done > max_bytes) refuse_size();
    if (done == buffer.size()) buffer.resize(std::min(2 * done + 4096, max_bytes + 1));
  }
  buffer.resize(done);
  return buffer;
}

}  // namespace

std::vector<std::byte> read_file(const fs::path& file, std::size_t max_bytes) {
  return read_whole<std::vector<std::byte>>(file, max_bytes);
}

std::string read_text_file(const fs::path& file, std::size_t max_bytes) {
  return read_whole<std::string>(file, max_bytes);
}

void read_file_blocks(const fs::path& file,
                      const std::function<void(std::span<const std::byte>)>& consume) {
  const OpenFile open = open_to_read(file);
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  while (const std::size_t count = read_some(open.descriptor, buffer, file))
    consume(std::span(buffer).first(count));
}

void make_folder(const fs::path& folder) {
  if (folder.empty()) return;
  std::error_code error;
  fs::create_directories(folder, error);
  // With a blank at the end of the path, or a race with another process, "false" is no error.
  if (error)
    fail(ErrorKind::Io, "{}: cannot be made a folder: {}", folder.string(), error.message());
  if (!fs::is_directory(folder, error)) fail(ErrorKind::Io, "{}: is not a folder", folder.string());
}

namespace {

/// The time that a folder's file system gives to what is written now. Clocks of machines differ.
std::optional<fs::file_time_type> time_now(const fs::path& folder) {
  try {
    const TemporaryFile file(folder / "now");
    write_temporary(file, folder / "now", {});
    return fs::last_write_time(file.path());
  } catch (const std::exception&) {
    return std::nullopt;  // nor could anything be removed there
  }
}

/// Whether the process that wrote under this temporary name may still be at it.
bool writer_may_live(const fs::path& temporary) {
  const std::string name = temporary.stem().string().substr(kPrefix.size());
  switch (process_state(name.substr(0, std::min(name.rfind('-'), name.size())))) {
    case ProcessState::Lives:
      return true;
    case ProcessState::Ended:
      return false;
    case ProcessState::Elsewhere:
      break;
  }
  std::error_code gone;
  const auto written = fs::last_write_time(temporary, gone);
  const auto now = time_now(temporary.parent_path());
  return !gone && (!now || *now - written < kForeignLifetime);
}

}  // namespace

void remove_temporaries(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::none, error);
  while (!error && entry != fs::recursive_directory_iterator()) {
    const fs::path path = entry->path();
    std::error_code ignored;
    const bool is_temporary = path.filename().string().starts_with(kPrefix) &&
                              entry->symlink_status(ignored).type() == fs::file_type::regular;
    if (is_temporary && !writer_may_live(path)) {
      std::error_code removing;
      fs::remove(path, removing);
      if (removing)
        fail(ErrorKind::Io, "{}: cannot be removed: {}", path.string(), removing.message());
    }
    entry.increment(error);
  }
  if (error) fail(ErrorKind::Io, "{}: cannot be listed: {}", folder.string(), error.message());
}

}  // namespace terracast::core
