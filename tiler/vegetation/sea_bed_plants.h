#pragma once

#include "tiler/bed_site.h"
#include "tiler/vegetation/plant_sink.h"
#include "tiler/vegetation/tile_places.h"

namespace terracast::tiler {

/// Seagrass where world/sea_bed.h says that it covers the bed, and boulders: some where the bed is rock, few on sand.
/// They take the places of kPlants and kStones that lie in the sea, where nothing of the land may stand.
class SeaBedPlants {
 public:
  /// all   live as long; a site that is no BedSite has no bed
  SeaBedPlants(const VegetationPlan& plan, const world::TileId& id, const LayerSite& site,
               TilePlaces& places, PlantSink& sink);

  void add_all();

 private:
  void add_seagrass(const BlueNoise::Place& place);
  void add_boulder(const BlueNoise::Place& place);
  bool is_bed(const BlueNoise::Place& place) const;
  /// Whether a disc is all below this much water, and nothing stands in it.
  bool has_room(const Eigen::Vector2d& place_world, double radius_m, double least_depth_m) const;
  /// Share of the bed that seagrass covers there.
  float seagrass(const Eigen::Vector2d& place_world) const;
  bool is_meadow(const Eigen::Vector2d& place_world, double radius_m) const;
  double bed_z_world(const Eigen::Vector2d& place_world) const;
  /// Sine of the bed's slope.
  float steepness(const Eigen::Vector2d& place_world) const;
  std::uint16_t heading_of(const PlaceDraws& draws) const;
  PlaceDraws draws(Stratum stratum, const BlueNoise::Place& place) const {
    return {plan_.seed, plan_.numbers.id(stratum, place.cell_x, place.cell_y)};
  }

  const VegetationPlan& plan_;
  world::TileId id_;
  const LayerSite& site_;
  const BedSite* bed_;
  TilePlaces& places_;
  PlantSink& sink_;
  std::uint32_t noise_seed_;
};

}  // namespace terracast::tiler
