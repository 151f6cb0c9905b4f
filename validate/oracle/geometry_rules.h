#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>

#include "validate/oracle/shown_geometry.h"
#include "validate/oracle/world_folder.h"

/// Whether the tiles that a dataset names are a ground, by the written rules of worlds alone.
namespace terracast::oracle {

/// A place from which the ground is seen.
struct Eye {
  Eigen::Vector3d position_world;
  double pixels_per_radian = 0.0;  ///< where the image resolves most
  std::string name;                ///< for messages
};

struct RuleFaults {
  std::int64_t count = 0;
  std::string first;            ///< what is wrong, and where, of the first one
  bool can_be_measured = true;  ///< every tile is in the world with the hash that is recorded
};

/// Counts what is wrong:
/// - a tile that the world has not, or has with another hash, or that is named twice
/// - a tile within another one; a place of the world's coarsest tiles that is in none
/// - tiles that share a side and differ by two levels or more
/// - a tile that could be split (its spacing is above finest_spacing_m), and whose spacing spans more
///   than cell_px pixels at its least distance from an eye
/// The last is asked with 10 µm and one part in 10^9 to spare, for poses are rounded. Tiles that are finer than
/// these eyes ask for are no fault: the sequence may have had other cameras.
/// cost   tiles times eyes
RuleFaults find_rule_faults(const ShownGeometry& geometry, const WorldFolder& world,
                            std::span<const Eye> eyes);

}  // namespace terracast::oracle
