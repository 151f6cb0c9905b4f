#include "tests/e2e/own_disk.h"

#include <sched.h>
#include <sys/mount.h>
#include <sys/statvfs.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>

namespace terracast::test {

namespace fs = std::filesystem;

OwnDisk::OwnDisk(const fs::path& folder) : folder_(folder) {
  fs::create_directories(folder_);
  // A name space of our own: nothing is left mounted, however the test ends.
  if (::unshare(CLONE_NEWNS) != 0 ||
      ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      ::mount("tmpfs", folder_.c_str(), "tmpfs", 0, kRoomy) != 0)
    why_not_ = std::generic_category().message(errno);
}

OwnDisk::~OwnDisk() {
  if (is_mounted()) ::umount2(folder_.c_str(), MNT_DETACH);
}

bool OwnDisk::fill(std::uint64_t room_bytes) {
  struct statvfs space {};
  ::statvfs(folder_.c_str(), &space);
  const std::uint64_t used = (space.f_blocks - space.f_bfree) * space.f_frsize;
  const std::string size = "size=" + std::to_string(used + room_bytes);
  return ::mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT, size.c_str()) == 0;
}

bool OwnDisk::make_read_only() {
  for (int i = 0; i < 2000; ++i) {
    if (::mount(nullptr, folder_.c_str(), nullptr, MS_REMOUNT | MS_BIND | MS_RDONLY, nullptr) == 0)
      return true;
    std::this_thread::sleep_for(std::chrono::microseconds(300));
  }
  return false;
}

void OwnDisk::restore() {
  ::mount(nullptr, folder_.c_str(), nullptr, MS_REMOUNT | MS_BIND, nullptr);
  ::mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT, kRoomy);
}

}  // namespace terracast::test
