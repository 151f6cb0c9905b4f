#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/json.h"
#include "world/volume.h"

namespace terracast::world {

/// What of an OpenVDB file is taken, and how.
struct VdbOptions {
  std::string grid = {};  ///< its name, "smoke[1]" of several smokes; "": density, or the only one
  double unit_m = 1.0;    ///< of a unit of the file's frame
  double voxel_m = 0.0;   ///< sides of the cubes; 0: as the grid has them
  double full = 0.0;      ///< value that is a density of 1; 0: the largest that there is
  bool is_upward_y = false;  ///< the file's y axis is up, as films have it, not z
};

/// Reads a grid of floats and samples it on cubes along its own frame's axes, in a process of its own
/// (core/reading_apart.h): OpenVDB trusts what a file states of its lengths and masks.
/// throws   Io: no such file, or it cannot be opened; Input: no OpenVDB file, damaged, no such grid or
///          one of another type, nothing in it, too many voxels; as core::read_apart()
Volume read_vdb(const std::filesystem::path& file, const VdbOptions& options);

/// The reader behind it, kind "vdb": an encoded volume, behind its name.
std::vector<std::byte> read_vdb_request(const core::Json& request);

/// A volume in a file.
struct VdbGrid {
  std::string name;
  const Volume* volume;
  double factor = 1.0;  ///< on the density
  Eigen::Affine3d file_from_volume = Eigen::Affine3d::Identity();
  /// Kept as the grid's metadata: names and texts.
  std::vector<std::pair<std::string, std::string>> notes = {};
};

/// The bytes of an OpenVDB file of float grids. Same grids, same bytes: where the format has a random
/// identity, it follows from the content.
std::vector<std::byte> encode_vdb(std::span<const VdbGrid> grids);

}  // namespace terracast::world
