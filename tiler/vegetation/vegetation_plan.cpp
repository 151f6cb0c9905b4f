#include "tiler/vegetation/vegetation_plan.h"

#include <algorithm>
#include <utility>

#include "tiler/world_options.h"

namespace terracast::tiler {
namespace {

/// Rows along ways and waters stand so near.
constexpr double kBeside_m = 8.0;

world::FieldPattern fields_of(const LayerInputs& inputs) {
  const WorldOptions& options = inputs.surface.options();
  return {static_cast<std::uint64_t>(options.seed),
          world::FieldPattern::grows_vines(options.origin_lat_deg)};
}

bool holds_any(const std::vector<const Layer*>& layers, const Eigen::Vector2d& place_world,
               double radius_m) {
  return std::any_of(layers.begin(), layers.end(),
                     [&](const Layer* layer) { return layer->holds(place_world, radius_m); });
}

}  // namespace

VegetationPlan::VegetationPlan(const LayerInputs& inputs)
    : surface(inputs.surface),
      seed(core::stream_of(inputs.seed, 0x7665676574ULL)),
      half_size_m(0.5 * inputs.size_m),
      library(PlantLibrary::grown()),
      numbers(inputs.size_m),
      habitat(seed, inputs.surface.options().origin_lat_deg, fields_of(inputs)),
      fields(fields_of(inputs)),
      dryness(Dryness::of(inputs.surface.options(), inputs.frame)) {
  const auto& layers = inputs.surface.options().layers;
  for (std::size_t i = 0; i < inputs.earlier.size() && i < layers.size(); ++i)
    for (const auto& [kind, of_kind] :
         {std::pair("buildings", &houses), std::pair("roads", &ways), std::pair("water", &waters)})
      if (layers[i].kind == kind) of_kind->push_back(inputs.earlier[i].get());
  for (std::size_t k = 0; k < kNumStrata; ++k) strewn.emplace_back(seed, k, kStrata[k].cell_m);
}

bool VegetationPlan::is_garden(const Eigen::Vector2d& place_world) const {
  constexpr double kGarden_m = 17.0;
  return holds_any(houses, place_world, kGarden_m);
}

bool VegetationPlan::is_by_way(const Eigen::Vector2d& place_world) const {
  return holds_any(ways, place_world, kBeside_m);
}

bool VegetationPlan::is_by_water(const Eigen::Vector2d& place_world) const {
  return holds_any(waters, place_world, kBeside_m);
}

bool VegetationPlan::is_kept_short(const Eigen::Vector2d& place_world) const {
  // The only ground that ways know of.
  return std::any_of(ways.begin(), ways.end(), [&](const Layer* layer) {
    return layer->cover(place_world, {}) == world::Cover::Grass;
  });
}

}  // namespace terracast::tiler
