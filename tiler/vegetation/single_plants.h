#pragma once

#include <initializer_list>
#include <string_view>
#include <vector>

#include "tiler/vegetation/forest_pieces.h"
#include "tiler/vegetation/near_places.h"
#include "tiler/vegetation/plant_sink.h"
#include "tiler/vegetation/tile_ground.h"
#include "tiler/vegetation/tile_places.h"

namespace terracast::tiler {

/// Plants and stones one by one. Each place decides by itself what stands on it, and is known by the number of
/// its cell.
class SinglePlants {
 public:
  /// all   live as long
  SinglePlants(const VegetationPlan& plan, const world::TileId& id, const LayerSite& site,
               TileGround& ground, TilePlaces& places, ForestPieces& pieces, PlantSink& sink)
      : plan_(plan),
        id_(id),
        site_(site),
        ground_(ground),
        places_(places),
        pieces_(pieces),
        sink_(sink) {}

  /// stratum   kTallTrees or kLowTrees
  void add_trees(Stratum stratum);
  void add_bushes();
  void add_plants();
  void add_stones();
  void add_crops();

 private:
  bool is_lone(Stratum stratum, const BlueNoise::Place& place);
  void add_tree(Stratum stratum, const BlueNoise::Place& place);
  void add_bush(const BlueNoise::Place& place, const NearPlaces& stems);
  void add_plant(const BlueNoise::Place& place);
  void add_stone(const BlueNoise::Place& place, const NearPlaces& stems);
  bool has_room(const Eigen::Vector2d& place_world, double radius_m) const;
  void add_crop(const CropPiece& crop, std::int32_t cell_x, std::int32_t cell_y);
  PlaceDraws draws(Stratum stratum, const BlueNoise::Place& place) const {
    return {plan_.seed, plan_.numbers.id(stratum, place.cell_x, place.cell_y)};
  }
  const std::vector<PlantModel>& of(std::string_view species) const {
    return plan_.library->of(species);
  }
  /// Of places that lie so near to a box that they matter there.
  NearPlaces stems_near(const PlanBox& box, std::initializer_list<Stratum> strata,
                        double distance_m);

  const VegetationPlan& plan_;
  world::TileId id_;
  const LayerSite& site_;
  TileGround& ground_;
  TilePlaces& places_;
  ForestPieces& pieces_;
  PlantSink& sink_;
};

/// Checks that no tree of a library reaches farther than tiles look for such.
void check_reach_of_trees(const PlantLibrary& library);

}  // namespace terracast::tiler
