#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>

namespace terracast::world {

/// A volume of a store.
struct VolumeInfo {
  std::string name;
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< voxels along x, y, z
  std::string content_hash;                        ///< of its file
};

/// A volume put into the world. Its axes are level and up at its place, turned by the heading.
struct VolumePlace {
  int volume = 0;                                         ///< row of WorldManifest::volumes
  int layer = 0;                                          ///< row of WorldManifest::layers
  Eigen::Vector3d place_world = Eigen::Vector3d::Zero();  ///< of the volume's own origin
  double heading_rad = 0.0;                               ///< anticlockwise
  double scale = 1.0;
  double extinction_per_m = 0.05;  ///< where the density is 1
  double albedo = 0.99;            ///< share of the light that is scattered on, not absorbed
  double anisotropy = 0.8;         ///< of scattering, the mean cosine (Henyey and Greenstein)
};

}  // namespace terracast::world
