#include "tiler/told_cover.h"

#include "tiler/dry_cover.h"
#include "tiler/layer.h"

namespace terracast::tiler {

ToldCovers::ToldCovers(std::span<const std::unique_ptr<Layer>> layers) {
  for (const auto& layer : layers) add(*layer);
}

void ToldCovers::add(const Layer& layer) {
  rows_.push_back({&layer, dynamic_cast<const DryCover*>(&layer) == nullptr});
}

std::optional<ToldCovers::Told> ToldCovers::at(const Eigen::Vector2d& place_world,
                                               const SurfaceSample& sample) const {
  std::optional<Told> told;
  for (const Row& row : rows_) {
    const bool was_water = told && world::is_water(told->cover);
    if (was_water) {
      if (row.layer->lift_m(place_world, sample) == 0.0) continue;
      told.reset();
    }
    if (told && !row.may_tell_of_water) continue;
    const std::optional<world::Cover> cover = row.layer->cover(place_world, sample);
    if (!cover || (told && !world::is_water(*cover))) continue;
    told = Told{*cover, row.layer};
  }
  return told;
}

bool ToldCovers::is_water(const Eigen::Vector2d& place_world, const SurfaceSample& sample) const {
  bool is_wet = false;
  for (const Row& row : rows_) {
    if (is_wet && row.layer->lift_m(place_world, sample) == 0.0) continue;
    is_wet = false;
    if (!row.may_tell_of_water) continue;
    const std::optional<world::Cover> cover = row.layer->cover(place_world, sample);
    is_wet = cover && world::is_water(*cover);
  }
  return is_wet;
}

bool ToldCovers::is_water_on(const WorldSurface& surface,
                             const Eigen::Vector2d& place_world) const {
  const SurfaceSample sample = surface.sample(place_world.x(), place_world.y());
  if (sample.cover != world::Cover::Land) return world::is_water(sample.cover);
  return is_water(place_world, sample);
}

}  // namespace terracast::tiler
