#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace terracast::test {

/// A disk of the test's own, which can be full or read-only.
class OwnDisk {
 public:
  explicit OwnDisk(const std::filesystem::path& folder);
  ~OwnDisk();
  OwnDisk(const OwnDisk&) = delete;
  OwnDisk& operator=(const OwnDisk&) = delete;

  bool is_mounted() const { return why_not_.empty(); }
  const std::string& why_not() const { return why_not_; }
  const std::filesystem::path& folder() const { return folder_; }

  /// Leaves so many bytes to be written.
  bool fill(std::uint64_t room_bytes);
  /// Not while a file is open for writing: a moment is waited for.
  bool make_read_only();
  void restore();

 private:
  static constexpr const char* kRoomy = "size=2g";  // more than a worker wants to see free
  std::filesystem::path folder_;
  std::string why_not_;
};

}  // namespace terracast::test
