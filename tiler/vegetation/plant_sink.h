#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "tiler/bed_site.h"
#include "tiler/layer.h"
#include "tiler/vegetation/vegetation_plan.h"

namespace terracast::tiler {

/// The last of some levels of which all have dry ground there, or the one before the first.
int last_level_on_land(const LayerSite& site, const Eigen::Vector2d& place_world,
                       double foot_z_world, int first_level, int last_level);

/// The last of some levels of which all have water round a place and show its bed no farther above
/// or below it than that, or the one before the first.
/// bed_z_world   of the place
/// within_m      what stands there is sunk by as much
int last_level_on_bed(const LayerSite& site, const BedSite& bed, const Eigen::Vector2d& place_world,
                      double bed_z_world, double within_m, int first_level, int last_level);

/// Puts plants on a tile, each shown up to the last level that has ground below it.
class PlantSink {
 public:
  /// all   live as long
  PlantSink(const VegetationPlan& plan, const LayerSite& site, world::TileObjects& objects)
      : plan_(plan), site_(site), objects_(objects) {}

  /// A plant to be put somewhere.
  struct Planting {
    std::uint32_t id;
    const PlantModel& model;
    std::uint16_t heading;
    double scale;
    int coarsest_level;
    int first_level = 0;  ///< finest of those whose tiles may lack the ground below it
    Tint tint{};
    double lowered_m = 0.0;  ///< its foot, below the bed
  };
  void add(const Planting& planting, const Eigen::Vector3d& foot_world);
  /// On the ground there.
  void add(const Planting& planting, const Eigen::Vector2d& place_world);
  /// On the bed below water, this deep.
  void add_on_bed(const Planting& planting, const BedSite& bed, const Eigen::Vector2d& place_world,
                  double water_depth_m);

 private:
  void add(const Planting& planting, const Eigen::Vector3d& foot_world, int last_level);

  const VegetationPlan& plan_;
  const LayerSite& site_;
  world::TileObjects& objects_;
};

}  // namespace terracast::tiler
