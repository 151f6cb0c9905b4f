#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "tiler/box_index.h"
#include "tiler/buildings/building.h"

namespace terracast::tiler {

struct RaisedCounts {
  std::int64_t num_lowered = 0;   ///< onto what is below them, which does not reach up to them
  std::int64_t num_grounded = 0;  ///< nothing is below or beside them that would carry them
  std::int64_t num_pairs = 0;     ///< that were looked at
};

/// Sees to it that what begins above the ground (BuildingDesign::bottom_m) is carried:
///
/// - by what lies below it and reaches up to it: it goes down to the floor behind a flat roof's
///   parapet, or where it stands on pitched roofs with nine tenths of its footprint to their eaves
///   (footing_m), so that it does not hang above them;
/// - else by what is as high beside it: of a part two corners stand at others, of a building the
///   middle lies between such corners, as of one that bridges a street;
/// - else it comes down to the highest of what is below it, or to the ground.
///
/// A pure function of the buildings, whatever their order: by what all of them say, not by what
/// becomes of it.
/// height_m   of the ground, ellipsoidal, about: buildings on ground of their own are compared by
///            it
/// threads    uses several
RaisedCounts settle_raised_bodies(
    std::vector<Building>& buildings, const BoxIndex& index,
    const std::function<double(const Eigen::Vector2d& place_world)>& height_m);

}  // namespace terracast::tiler
