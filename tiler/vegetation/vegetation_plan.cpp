#include "tiler/vegetation/vegetation_plan.h"

#include <algorithm>

#include "tiler/world_options.h"

namespace terracast::tiler {

VegetationPlan::VegetationPlan(const LayerInputs& inputs)
    : surface(inputs.surface),
      seed(core::stream_of(inputs.seed, 0x7665676574ULL)),
      half_size_m(0.5 * inputs.size_m),
      library(PlantLibrary::grown()),
      numbers(inputs.size_m),
      habitat(seed, inputs.surface.options().origin_lat_deg),
      fields(world::FieldPattern(
          static_cast<std::uint64_t>(inputs.surface.options().seed),
          world::FieldPattern::grows_vines(inputs.surface.options().origin_lat_deg))) {
  const auto& layers = inputs.surface.options().layers;
  for (std::size_t i = 0; i < inputs.earlier.size() && i < layers.size(); ++i)
    if (layers[i].kind == "buildings") houses.push_back(inputs.earlier[i].get());
  for (std::size_t k = 0; k < kNumStrata; ++k) strewn.emplace_back(seed, k, kStrata[k].cell_m);
}

bool VegetationPlan::is_garden(const Eigen::Vector2d& place_world) const {
  constexpr double kGarden_m = 17.0;
  return std::any_of(houses.begin(), houses.end(),
                     [&](const Layer* layer) { return layer->holds(place_world, kGarden_m); });
}

}  // namespace terracast::tiler
