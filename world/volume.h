#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace terracast::world {

/// Density in space, such as that of a cloud: 1 is full, 0 is clear air. Values stand at the centres of
/// voxels, are linear between them, and 0 beyond.
struct Volume {
  std::string name;
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< voxels along x, y, z
  double voxel_m = 1.0;                            ///< side of a voxel
  Eigen::Vector3d lowest_m =
      Eigen::Vector3d::Zero();        ///< corner of the first voxel, in its own frame
  std::vector<std::uint8_t> density;  ///< in 1/255; x runs fastest, then y

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(x);
  }
  bool operator==(const Volume&) const = default;
};

/// More voxels no volume has, and no more all volumes of a world together.
inline constexpr std::size_t kMaxVoxels = std::size_t{1} << 28;
inline constexpr int kMaxVolumeSide = 4096;

/// throws   Input: no voxels, or too many; names the volume
void check_volume(const std::string& name, const Eigen::Vector3i& size);

/// The bytes of a volume's file: a header and the density, deflated. Same volume, same bytes.
std::vector<std::byte> encode_volume(const Volume& volume);

/// What encode_volume() wrote, but for the name.
/// throws   Input: damaged; names the file
Volume decode_volume(std::span<const std::byte> bytes, const std::string& file);

}  // namespace terracast::world
