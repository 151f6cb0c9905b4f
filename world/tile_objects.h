#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "world/ground_paint.h"
#include "world/shape.h"

namespace terracast::world {

/// Where an object comes from.
struct Provenance {
  /// Unique in the world, never 0; the same whatever the tiles, their levels, the order of sources
  /// and what else stands in the world.
  std::uint32_t instance_id = 0;
  std::uint8_t layer = 0;     ///< row of WorldManifest::layers
  std::uint64_t feature = 0;  ///< the number by which its layer's source knows it
  bool operator==(const Provenance&) const = default;
};

/// An object with a shape of its own, such as a building or a bridge.
struct Solid {
  Provenance provenance;
  /// World x, y in whole metres of its place. The tile of a cut that holds it decides how finely the
  /// object is shown, in all tiles over which it reaches.
  Eigen::Vector2i place_m = Eigen::Vector2i::Zero();
  Eigen::Vector3i origin_steps = Eigen::Vector3i::Zero();  ///< of its shapes, in the world frame
  ShapeLevels levels;

  bool operator==(const Solid&) const = default;
};

/// A prototype put into the world. It stands upright: its z axis is up at its place.
struct Instance {
  Provenance provenance;
  std::uint16_t prototype = 0;  ///< row of WorldManifest::prototypes
  /// Foot, in the world frame, in steps of kHeightStep_m. The tile of a cut that holds it decides
  /// how finely the prototype is shown.
  Eigen::Vector3i place_steps = Eigen::Vector3i::Zero();
  std::uint16_t heading = 0;   ///< anticlockwise from the prototype's own, in 2^-16 turns
  std::uint16_t scale = 4096;  ///< in 2^-12
  std::uint8_t variety = 0;    ///< draws its colours
  std::int8_t coarsest_level =
      127;  ///< on coarser tiles it is not shown, whatever its prototype says

  bool operator==(const Instance&) const = default;
};

/// All that stands on a tile or reaches over its square, and what is painted on its ground. What
/// reaches over several tiles stands in each of them, whole; a ray meets it once, in the tile in whose
/// square the meeting lies.
struct TileObjects {
  std::vector<Solid> solids;
  std::vector<Instance> instances;
  std::vector<Strip> strips;
  std::vector<Area> areas;

  bool operator==(const TileObjects&) const = default;
  bool is_empty() const {
    return solids.empty() && instances.empty() && strips.empty() && areas.empty();
  }
};

}  // namespace terracast::world
