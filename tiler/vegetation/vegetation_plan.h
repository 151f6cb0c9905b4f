#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "tiler/dryness.h"
#include "tiler/layer.h"
#include "tiler/surface.h"
#include "tiler/vegetation/blue_noise.h"
#include "tiler/vegetation/canopy.h"
#include "tiler/vegetation/fields.h"
#include "tiler/vegetation/habitat.h"
#include "tiler/vegetation/plant_library.h"
#include "tiler/vegetation/strata.h"

namespace terracast::tiler {

/// What the planting of all tiles of a world follows.
///
/// threads   safe
struct VegetationPlan {
  /// throws   Config: as CellNumbers
  explicit VegetationPlan(const LayerInputs& inputs);

  /// Whether a house stands near by.
  bool is_garden(const Eigen::Vector2d& place_world) const;
  /// Whether a way, or a river, a stream or a lake is so near that rows of plants may go along with it.
  bool is_by_way(const Eigen::Vector2d& place_world) const;
  bool is_by_water(const Eigen::Vector2d& place_world) const;
  /// Whether nothing but grass may grow there: between runways.
  bool is_kept_short(const Eigen::Vector2d& place_world) const;

  const WorldSurface& surface;  ///< the ground before any layer
  std::uint64_t seed;
  double half_size_m;
  std::shared_ptr<const PlantLibrary> library;
  CellNumbers numbers;
  Habitat habitat;
  Fields fields;
  std::vector<const Layer*> houses;        ///< layers of buildings
  std::vector<const Layer*> ways;          ///< layers of roads
  std::vector<const Layer*> waters;        ///< layers of water
  std::vector<BlueNoise> strewn;           ///< by Stratum
  std::unique_ptr<Canopy> canopy;          ///< null: none is known
  std::shared_ptr<const Dryness> dryness;  ///< null: the land is humid
};

}  // namespace terracast::tiler
