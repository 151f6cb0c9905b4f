#include "world/volume.h"

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/hash.h"
#include "world/byte_stream.h"
#include "world/deflated.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::uint64_t kMagic = 0x31304c4f56435421;  // "!TCVOL01"
constexpr double kMaxSize_m = 1e7;

struct Header {
  std::uint64_t magic = kMagic;
  std::uint64_t checksum = 0;  ///< of all that follows
  std::int32_t size[3] = {};
  std::uint32_t reserved = 0;
  double voxel_m = 0.0;
  double lowest_m[3] = {};
};
static_assert(sizeof(Header) == 64);
constexpr std::size_t kHashedFrom = 16;

}  // namespace

void check_volume(const std::string& name, const Eigen::Vector3i& size) {
  if ((size.array() < 1).any() || (size.array() > kMaxVolumeSide).any() ||
      size.cast<double>().prod() > static_cast<double>(kMaxVoxels))
    fail(ErrorKind::Input,
         "volume \"{}\": {} x {} x {} voxels; 1 to {} a side and {} in all are right", name,
         size.x(), size.y(), size.z(), kMaxVolumeSide, kMaxVoxels);
}

std::vector<std::byte> encode_volume(const Volume& volume) {
  check_volume(volume.name, volume.size);
  TERRACAST_CHECK(
      volume.density.size() == static_cast<std::size_t>(volume.size.cast<double>().prod()),
      "{} values", volume.density.size());
  Header header;
  for (int k = 0; k < 3; ++k) {
    header.size[k] = volume.size[k];
    header.lowest_m[k] = volume.lowest_m[k];
  }
  header.voxel_m = volume.voxel_m;
  std::vector<std::byte> bytes(sizeof header);
  append_deflated(bytes, volume.density);
  std::memcpy(bytes.data(), &header, sizeof header);
  header.checksum = core::content_hash64(std::span<const std::byte>(bytes).subspan(kHashedFrom));
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

Volume decode_volume(std::span<const std::byte> bytes, const std::string& file) {
  const auto refuse = [&](const char* why) {
    fail(ErrorKind::Input, "{}: {}; tile the world again", file, why);
  };
  Header header;
  if (bytes.size() < sizeof header) refuse("too short for a volume");
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.magic != kMagic) refuse("not a volume");
  if (header.checksum != core::content_hash64(bytes.subspan(kHashedFrom))) refuse("damaged");
  Volume volume;
  volume.name = file;
  for (int k = 0; k < 3; ++k) {
    volume.size[k] = header.size[k];
    volume.lowest_m[k] = header.lowest_m[k];
    if (!(std::abs(header.lowest_m[k]) <= kMaxSize_m)) refuse("its corner is out of the world");
  }
  check_volume(file, volume.size);
  volume.voxel_m = header.voxel_m;
  if (!(header.voxel_m > 0.0 && header.voxel_m <= kMaxSize_m)) refuse("its voxels have no size");
  volume.density = inflated(bytes.subspan(sizeof header),
                            static_cast<std::size_t>(volume.size.cast<double>().prod()), file);
  return volume;
}

}  // namespace terracast::world
