#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tiler/buildings/building_design.h"
#include "tiler/buildings/footprint.h"
#include "tiler/buildings/height_raster.h"
#include "tiler/feature_source.h"

namespace terracast::tiler {

/// A building that stands, or a part of one.
struct Building {
  std::uint64_t feature = 0;
  std::uint64_t key = 0;  ///< of its instance id
  Footprint footprint;
  BuildingDesign design;
  std::vector<bool> attached;  ///< edges at which others stand
  std::uint64_t own = 0;       ///< drawn for it
  /// Parts: the outline's corners, about the place, under which the ground is looked at; else empty.
  std::vector<Eigen::Vector2i> ground_steps;
  Eigen::Vector2d lowest_world = Eigen::Vector2d::Zero();  ///< of the footprint
  Eigen::Vector2d highest_world = Eigen::Vector2d::Zero();
};

/// Rows of a table of buildings by where they lie.
class BuildingIndex {
 public:
  void add(std::uint32_t row, const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest);
  void finish();
  /// All that may lie in a box and come before a row, each once, ascending.
  std::vector<std::uint32_t> rows_in(
      const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest,
      std::uint32_t before = std::numeric_limits<std::uint32_t>::max()) const;

 private:
  /// Cell and row, sorted.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> entries_;
  Eigen::Vector2d lowest_ = Eigen::Vector2d::Constant(1e18);
  Eigen::Vector2d highest_ = Eigen::Vector2d::Constant(-1e18);
};

/// All buildings of a world, each checked against its neighbours: a pure function of the features,
/// whatever their order.
struct Town {
  std::vector<Building> buildings;  ///< by feature, then part
  BuildingIndex index;
  std::vector<std::pair<std::string, std::int64_t>> counts;  ///< for LayerInfo::counts
};

/// What a town is asked of its ground.
struct TownGround {
  std::function<bool(const Eigen::Vector2d& place_world)> is_water;
  std::function<bool(const Eigen::Vector2d& place_world)> is_sea;
  std::function<bool(const Eigen::Vector2d& place_world)> is_taken;    ///< by other layers
  std::function<double(const Eigen::Vector2d& place_world)> height_m;  ///< ellipsoidal, about
  double latitude_deg = 0.0;
};

/// raster   of heights; may be null
/// cost     10 us a footprint
Town build_town(const std::vector<VectorFeature>& features, const HeightRaster* raster,
                const TownGround& ground, double size_m, std::uint64_t seed);

}  // namespace terracast::tiler
