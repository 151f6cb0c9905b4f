#include "world/vdb/vdb_lengths.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string>

#include "core/error.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::uint64_t kMagic = 0x56444220;
/// Since then each grid states its own compression.
constexpr std::uint32_t kOldestFormat = 222;
constexpr std::uint64_t kIdentityLength = 36;

/// Goes over a file as OpenVDB's Archive, MetaMap and GridDescriptor do, and keeps nothing of it.
class Lengths {
 public:
  explicit Lengths(const std::filesystem::path& file)
      : name_(file.string()), in_(file, std::ios::binary) {
    if (!in_) fail(ErrorKind::Io, "{}: cannot be read; look at its rights", name_);
    size_ = std::filesystem::file_size(file);
    if (size_ == 0)
      fail(ErrorKind::Input, "{}: is empty, a file of 0 bytes; fetch or write it again", name_);
  }

  void check() {
    if (take<std::uint64_t>() != kMagic)
      fail(ErrorKind::Input, "{}: it does not begin as an OpenVDB file does; is it one?", name_);
    const auto format = take<std::uint32_t>();
    if (format < kOldestFormat)
      fail(ErrorKind::Input,
           "{}: an OpenVDB file of format {}, from before 2013; read and write it with a newer "
           "OpenVDB",
           name_, format);
    pass(2 * sizeof(std::uint32_t));  // the library's version
    const bool has_offsets = take<std::uint8_t>() != 0;
    pass(kIdentityLength);
    pass_metadata();
    const auto num_grids = take<std::int32_t>();
    if (num_grids < 0 || static_cast<std::uint64_t>(num_grids) > size_)
      fail(ErrorKind::Input, "{}: states {} grids in {} bytes; is it damaged?", name_, num_grids,
           size_);
    for (std::int32_t k = 0; k < (has_offsets ? num_grids : std::min(num_grids, 1)); ++k) {
      for (int text = 0; text < 3; ++text) pass_text();  // its name, type and parent
      pass(2 * sizeof(std::int64_t));
      const auto end = take<std::int64_t>();
      pass(sizeof(std::uint32_t));  // compression
      pass_metadata();
      pass_text();  // kind of transform
      if (!has_offsets) return;
      if (end < 0 || static_cast<std::uint64_t>(end) < at_)
        fail(ErrorKind::Input, "{}: its grid {} ends before it begins; is it damaged?", name_, k);
      pass(static_cast<std::uint64_t>(end) - at_);
    }
  }

 private:
  template <class Value>
  Value take() {
    Value value{};
    if (!in_.read(reinterpret_cast<char*>(&value), sizeof value))
      fail(ErrorKind::Input, "{}: ends after {} bytes within a grid's head; is it damaged?", name_,
           size_);
    at_ += sizeof value;
    return value;
  }
  void pass(std::uint64_t num_bytes) {
    if (num_bytes > size_ - at_)
      fail(ErrorKind::Input, "{}: states {} bytes at byte {} of its {}; is it damaged?", name_,
           num_bytes, at_, size_);
    at_ += num_bytes;
    in_.seekg(static_cast<std::streamoff>(at_));
  }
  void pass_text() { pass(take<std::uint32_t>()); }
  void pass_metadata() {
    // Each takes 12 bytes at least, so that a false count ends with the file.
    for (auto left = take<std::uint32_t>(); left > 0; --left) {
      pass_text();
      pass_text();
      pass(take<std::uint32_t>());
    }
  }

  std::string name_;
  std::ifstream in_;
  std::uint64_t size_ = 0;
  std::uint64_t at_ = 0;
};

}  // namespace

void check_vdb_lengths(const std::filesystem::path& file) { Lengths(file).check(); }

}  // namespace terracast::world
