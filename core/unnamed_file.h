#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace terracast::core {

/// A file without a name, in the folder for temporary files (TMPDIR, or /tmp): its space is free again when the last
/// process that has it open closes it, however that ends.
class UnnamedFile {
 public:
  /// throws   Io: the folder takes no file
  UnnamedFile();
  ~UnnamedFile();
  UnnamedFile(const UnnamedFile&) = delete;
  UnnamedFile& operator=(const UnnamedFile&) = delete;

  int descriptor() const { return descriptor_; }
  /// throws   Io: the system does not say
  std::uint64_t size_bytes() const;

  /// Fills `out` with what stands from a place on. Threads: safe.
  /// throws   Io: it cannot be read, or ends before
  void read(std::uint64_t from_byte, std::span<std::byte> out) const;

 private:
  int descriptor_ = -1;
};

}  // namespace terracast::core
