#include "core/unnamed_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>

#include "core/error.h"

namespace terracast::core {
namespace {

int open_unnamed(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (descriptor >= 0) return descriptor;
  // File systems of networks know no files without names: one is made, and its name taken away.
  std::string name = (folder / "terracast-XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

UnnamedFile::UnnamedFile() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error)
    fail(ErrorKind::Io, "the folder for temporary files (TMPDIR, or /tmp): {}", error.message());
  descriptor_ = open_unnamed(folder);
  if (descriptor_ < 0)
    fail(ErrorKind::Io, "{}: takes no temporary file ({}); state another folder as TMPDIR",
         folder.string(), std::generic_category().message(errno));
}

UnnamedFile::~UnnamedFile() { ::close(descriptor_); }

std::uint64_t UnnamedFile::size_bytes() const {
  struct stat status = {};
  if (::fstat(descriptor_, &status) != 0)
    fail(ErrorKind::Io, "a temporary file: {}", std::generic_category().message(errno));
  return static_cast<std::uint64_t>(status.st_size);
}

void UnnamedFile::read(std::uint64_t from_byte, std::span<std::byte> out) const {
  while (!out.empty()) {
    const ssize_t count =
        ::pread(descriptor_, out.data(), out.size(), static_cast<off_t>(from_byte));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0)
      fail(ErrorKind::Io, "a temporary file: {}",
           count == 0 ? "it ends too early" : std::generic_category().message(errno));
    from_byte += static_cast<std::uint64_t>(count);
    out = out.subspan(static_cast<std::size_t>(count));
  }
}

}  // namespace terracast::core
