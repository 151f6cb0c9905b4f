#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "tiler/roads/road_network.h"
#include "tiler/roads/water_gaps.h"
#include "world/tile_objects.h"

namespace terracast::tiler {

/// An area as its source has it.
struct PaintedArea {
  std::uint64_t feature = 0;
  PadStyle style;
  std::vector<PointsWorld> rings_world;
};

/// Where people cross: on a way, or near one.
struct FootCrossing {
  std::uint64_t feature = 0;
  Eigen::Vector2d at_world;
};

/// All that is painted on the ground for ways and areas, found by tile.
class RoadPaint {
 public:
  /// Parts of lines, along each.
  using Gaps = std::vector<std::vector<std::pair<double, double>>>;

  /// Ways on the ground: strips with their marks, which stop before junctions; sidewalks.
  /// gaps   where nothing is painted (water_gaps)
  void add_network(const RoadNetwork& network, const Gaps& gaps);
  /// is_water   no stands are marked there
  void add_areas(const std::vector<PaintedArea>& areas, const IsWater& is_water);
  /// Zebras on the nearest way; where the source knows of none, at junctions of streets.
  void add_crossings(const RoadNetwork& network, const std::vector<FootCrossing>& crossings,
                     std::uint64_t seed);
  /// Once all is there.
  void index();

  /// What reaches over a tile's square and is shown on its level.
  void add_to(const world::TileId& id, world::TileObjects& objects) const;

  std::int64_t num_strips() const { return static_cast<std::int64_t>(strips_.size()); }
  std::int64_t num_crossings() const { return num_crossings_; }

 private:
  struct Run;
  template <class Coat>
  struct Painted {
    Coat coat;
    Eigen::Vector2d lowest;
    Eigen::Vector2d highest;
    int coarsest_level = 0;
  };
  void add_run(const Run& run);
  void add_strip(const world::Strip& like, const PointsWorld& points, double start_m,
                 int coarsest_level);
  void add_stands(const PaintedArea& area, const IsWater& is_water);
  void add_zebra(const RoadNetwork& network, const Line& line, std::uint32_t point,
                 const Span& span, const Eigen::Vector2d& at_world, std::uint64_t feature);

  std::vector<Painted<world::Strip>> strips_;
  std::vector<Painted<world::Area>> areas_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> strip_cells_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> area_cells_;
  std::int64_t num_crossings_ = 0;
};

/// The number of a runway along a line: of its name ("03/21") or its bearing.
std::uint8_t runway_number(std::string_view ref, const Eigen::Vector2d& direction);

}  // namespace terracast::tiler
