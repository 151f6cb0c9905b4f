#pragma once

#include <array>
#include <optional>

#include "tiler/bed_site.h"
#include "tiler/vegetation/plant_sink.h"
#include "tiler/vegetation/tile_places.h"
#include "world/sea_bed.h"

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
  /// A place, and eight round it.
  using Round = std::array<Eigen::Vector2d, 9>;
  static Round round_of(const Eigen::Vector2d& place_world, double radius_m);
  /// What covers the bed at them, and how steep it is, all about the first.
  struct Bed {
    std::array<double, 9> depth_m;
    world::sea_bed::Noise noise;
    float steepness;  ///< sine of the slope of the plane that fits the eight best
  };
  Bed bed_at(const Eigen::Vector2d& place_world, double radius_m) const;

  /// Whether places round another are all below this much water, and nothing stands between them.
  bool has_room(const Eigen::Vector2d& place_world, double radius_m, double least_depth_m) const;
  /// By how much the foot of a tuft must be lowered that the bed holds it all round.
  double lowered_m(const Eigen::Vector2d& place_world, double depth_m, const PlantModel& model,
                   double scale) const;
  struct Tuft {
    double scale;
    double lowered_m;
  };
  /// The largest tuft that the meadow and the bed have room for.
  std::optional<Tuft> tuft_at(const Eigen::Vector2d& place_world, double depth_m,
                              const PlantModel& model, double largest) const;
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

/// That no seagrass and no boulder reaches farther than kStrata says.
void check_reach_on_bed(const PlantLibrary& library);

}  // namespace terracast::tiler
