#include "world/sealed_file.h"

#include <algorithm>
#include <cstring>

#include "core/error.h"
#include "core/hash.h"
#include "world/deflated.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kHashedFrom = 16;
/// Deflate packs no tighter.
constexpr std::size_t kMostInflation = 1032;

struct Header {
  std::array<char, 6> magic;
  std::uint16_t version;
  std::uint64_t checksum;
  std::uint64_t num_bytes;
};
static_assert(sizeof(Header) == 24);

}  // namespace

std::vector<std::byte> sealed(const SealedKind& kind, std::span<const std::uint8_t> content) {
  TERRACAST_CHECK(content.size() <= kind.most_bytes, "{} bytes for {}", content.size(), kind.what);
  Header header{kind.magic, kind.version, 0, content.size()};
  std::vector<std::byte> bytes(sizeof header);
  append_deflated(bytes, content);
  std::memcpy(bytes.data(), &header, sizeof header);
  header.checksum = core::content_hash64(std::span<const std::byte>(bytes).subspan(kHashedFrom));
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

std::vector<std::uint8_t> unsealed(const SealedKind& kind, std::span<const std::byte> bytes,
                                   const std::string& file) {
  Header header{};
  if (bytes.size() < sizeof header)
    fail(ErrorKind::Input, "{}: {} bytes are too few for {}; tile the world again", file,
         bytes.size(), kind.what);
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.magic != kind.magic)
    fail(ErrorKind::Input, "{}: not {} (it does not start with {}); tile the world again", file,
         kind.what, std::string_view(kind.magic.data(), kind.magic.size()));
  if (header.version != kind.version)
    fail(ErrorKind::Input, "{}: {} of format version {}, this build reads {}; tile the world again",
         file, kind.what, header.version, kind.version);
  if (header.checksum != core::content_hash64(bytes.subspan(kHashedFrom)) ||
      header.num_bytes > std::min(kind.most_bytes, kMostInflation * bytes.size()))
    fail(ErrorKind::Input, "{}: damaged: its checksum is not its content's; tile the world again",
         file);
  return inflated(bytes.subspan(sizeof header), header.num_bytes, file);
}

}  // namespace terracast::world
