#include "world/vdb/vdb_stream.h"

#include <openvdb/io/Stream.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <sstream>
#include <string>

#include "core/error.h"
#include "core/hash.h"

namespace terracast::world {
namespace {

/// Where a file holds its identity, 36 characters: after magic number, versions and a flag.
constexpr std::size_t kIdentityAt = 21;
constexpr std::size_t kIdentityLength = 36;

}  // namespace

void initialise_vdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

std::vector<std::byte> bytes_of_grids(const openvdb::GridCPtrVec& grids) {
  std::ostringstream out(std::ios_base::binary);
  openvdb::io::Stream(out).write(grids);
  const std::string text = std::move(out).str();
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  TERRACAST_CHECK(bytes.size() > kIdentityAt + kIdentityLength, "{} bytes", bytes.size());
  std::fill_n(bytes.begin() + kIdentityAt, kIdentityLength, std::byte{'0'});
  const std::string hash = core::content_hash(bytes);
  const std::string identity = hash.substr(0, 8) + "-" + hash.substr(8, 4) + "-" +
                               hash.substr(12, 4) + "-" + hash.substr(16, 4) + "-" +
                               hash.substr(20, 12);
  std::memcpy(bytes.data() + kIdentityAt, identity.data(), kIdentityLength);
  return bytes;
}

}  // namespace terracast::world
