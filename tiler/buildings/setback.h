#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tiler/buildings/town.h"

namespace terracast::tiler {

/// Walls of what lies over nothing else stand back so far from the footprint, so that those of two
/// houses on one line are two.
inline constexpr double kInset_m = 0.010;
/// What lies over others stands back by so much more for each rank, and its top and its foundation
/// are so much lower. Planes of nearby ranks are apart by more than their rounding to steps moves
/// them (1.4 steps of 0.98 mm).
inline constexpr double kSetback_m = 0.006;
/// Ranks go from 0 to this one.
inline constexpr int kMostRank = 15;
/// No walls stand farther back.
inline constexpr double kMostInset_m = kInset_m + kMostRank * kSetback_m;
/// Bottoms, and tops of blocks, lie on levels so far apart, above the ellipsoid, and lower by the
/// setback: those of two ranks are apart whatever the ground is. Beyond 200 m the Earth's curvature
/// brings levels through two places together.
inline constexpr double kLevels_m = (kMostRank + 2) * kSetback_m;
/// The bottom of what begins above the ground is so much lower than it says, and by its own
/// setback: it reaches into what carries it, of whatever rank that is, and lies half a setback off
/// any top.
inline constexpr double kBodySunk_m = 1.5 * kSetback_m + kMostRank * kSetback_m;

/// The rings on which a building of a rank stands.
RingsSteps walls_of(const Building& building, int rank);

/// Of an earlier layer, and the ranks that they have.
struct RankedBuildings {
  const std::vector<Building>& buildings;
  const std::vector<int>& ranks;
};

struct Setbacks {
  std::vector<int> ranks;                                    ///< of each building
  std::vector<std::pair<std::string, std::int64_t>> counts;  ///< for LayerInfo::counts; none of 0
  std::int64_t num_pairs = 0;  ///< of buildings in common cells of the index that were looked at
};

/// Ranks by which buildings that lie over each other stand back, so that they have no faces in one
/// plane: of each, in their order, the least that keeps its walls, top and bottom off those of all
/// earlier ones that it lies over; 0 where it lies over none. As blocks (block_of()), by which
/// coarse tiles show them, neighbours may lie over each other that do not else: their tops, bottoms
/// and walls are kept apart, too. Walls are kept apart that run along each other for 48 mm and more,
/// whether both buildings lie on one side of them or, where neighbours are drawn a few centimetres
/// into each other, on either; those of blocks as far as ranks can do that. Walls are left that
/// cross at each difference of two ranks. A pure function of the footprints and their order.
/// earlier  of other layers, which go before all of these and keep their ranks
/// limits   faces may still lie in one plane where a building finds no rank free (it is given the
///          one with the fewest tops and bottoms in one plane, of these with the fewest walls, then
///          with the least of blocks' walls, and counted; for blocks' walls alone, from 1 m of two
///          on), lies over more than 64 earlier ones, or its box meets more than 1024 (those beyond
///          are not looked at, it is counted), and where heights differ by about a whole number of
///          setbacks, such as 12.006 and 12.000 m one rank apart
/// cost     edges of at most 1024 pairs of footprints a building, and boxes of those before them in
///          its cells of the index; edges of 64 pairs of blocks for each rank that is tried; 12 bytes
///          a pair that lie over each other
Setbacks setback_ranks(const std::vector<Building>& buildings,
                       const std::vector<RankedBuildings>& earlier = {});

}  // namespace terracast::tiler
