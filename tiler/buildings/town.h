#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "tiler/box_index.h"
#include "tiler/buildings/building.h"
#include "tiler/buildings/height_raster.h"
#include "tiler/feature_source.h"

namespace terracast::tiler {

/// All buildings of a world, each checked against its neighbours: a pure function of the features,
/// whatever their order.
struct Town {
  std::vector<Building> buildings;  ///< by feature, then part
  BoxIndex index;
  std::vector<std::pair<std::string, std::int64_t>> counts;  ///< for LayerInfo::counts
  std::int64_t num_pairs = 0;  ///< of footprints near each other that were looked at, all in all
};

/// So many footprints stand in a cell of a BoxIndex, those of small buildings in 48 m by 48 m;
/// smaller ones beyond that are left out, and counted. Sheds of 4 m2 side by side are fewer.
inline constexpr std::size_t kMostInCell = 640;

/// By the numbers of features that were made of a raster of heights: how high they stand above the
/// ground there, m. No tag says it, since files from anywhere hold tags.
using MeasuredHeights = std::unordered_map<std::uint64_t, double>;

/// What a town is asked of its ground.
struct TownGround {
  std::function<bool(const Eigen::Vector2d& place_world)> is_water;
  std::function<bool(const Eigen::Vector2d& place_world)> is_sea;
  std::function<bool(const Eigen::Vector2d& place_world)> is_taken;    ///< by layers of other kinds
  std::function<double(const Eigen::Vector2d& place_world)> height_m;  ///< ellipsoidal, about
  double latitude_deg = 0.0;
  /// Of the layers of buildings before: what these have is not built again.
  std::vector<const Town*> earlier = {};
};

/// Share of a footprint in buildings of earlier layers from which on it is one of theirs. A house
/// of a row that is drawn aside by up to a third of its width and depth lies to (2/3)^2 = 0.44 and
/// more in itself, and to a third at most in the house beside it.
inline constexpr double kShareOfEarlier = 0.4;

/// raster     of heights; may be null
/// measured   of features whose heights were measured, which no raster is asked for
/// cost       10 us a footprint; pairs of footprints only of those near each other
///            (Town::num_pairs), of which kMostInCell bounds the number: what is the same footprint
///            a hundred thousand times costs no pair
Town build_town(const std::vector<VectorFeature>& features, const HeightRaster* raster,
                const TownGround& ground, double size_m, std::uint64_t seed,
                const MeasuredHeights& measured_m = {});

}  // namespace terracast::tiler
