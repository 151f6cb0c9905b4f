#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tiler/buildings/building_design.h"
#include "tiler/buildings/footprint.h"
#include "world/shape.h"

namespace terracast::tiler {

/// How much of a building is shown.
enum class BuildingDetail : std::uint8_t {
  Fine,   ///< eaves, parapets, chimneys, plant on roofs
  Plain,  ///< walls and roof
  Block,  ///< as high, with few corners
};

/// A building to be built.
struct BuildingPlan {
  RingsSteps rings;  ///< of its walls, about its place
  const BuildingDesign* design = nullptr;
  /// Edges at which others stand, ring by ring: no eaves reach over them.
  std::vector<bool> attached;
  std::uint64_t own = 0;  ///< drawn for it
  /// From steps about its place, level there, to steps along the world's axes.
  Eigen::Matrix3d world_from_level = Eigen::Matrix3d::Identity();
  double setback_steps = 0.0;  ///< by how much its top, and a bottom above the ground, are lowered
  double foundation_steps = 0.0;      ///< how deep its walls go below its lowest ground
  double highest_ground_steps = 0.0;  ///< above its lowest ground, which is 0
  double lowest_ground_steps = 0.0;   ///< above the ellipsoid
  /// The top of a Block lies, before it is lowered, at the nearest multiple of this above the
  /// ellipsoid; 0: where it is.
  double levels_steps = 0.0;
};

/// The building as one closed surface (a Block may be wider than the building): each edge has two
/// triangles, which go along it in opposite directions, and it is turned outward. Vertices are
/// steps from its place at the lowest ground under it.
/// threads   safe
world::Shape building_shape(const BuildingPlan& plan, BuildingDetail detail);

/// Whether the roof of its design fits its footprint; where it does not, building_shape() builds a hipped one, or none.
bool bears_its_roof(const BuildingPlan& plan);

}  // namespace terracast::tiler
