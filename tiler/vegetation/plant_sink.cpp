#include "tiler/vegetation/plant_sink.h"

#include <algorithm>
#include <cmath>

#include "tiler/shown_ground.h"
#include "world/tile_id.h"

namespace terracast::tiler {

using Eigen::Vector2d;
using Eigen::Vector3d;

int last_level_on_land(const LayerSite& site, const Vector2d& place_world, double foot_z_world,
                       int first_level, int last_level) {
  const int last = last_level_with_ground(site, place_world, foot_z_world, first_level, last_level);
  // What grows has more room than samples of finer tiles are apart.
  for (int level = std::max(first_level, 0); level <= last; ++level)
    if (is_amid_water(site, place_world, level)) return level - 1;
  return last;
}

void PlantSink::add(std::uint32_t id, const PlantModel& model, const Vector3d& foot_world,
                    std::uint16_t heading, double scale, int coarsest_level, int first_level) {
  world::Instance instance;
  instance.provenance.instance_id = id;
  instance.provenance.feature = id;
  instance.prototype = model.prototype;
  instance.place_steps =
      (foot_world / world::kHeightStep_m).array().round().cast<std::int32_t>().matrix();
  instance.heading = heading;
  instance.scale = static_cast<std::uint16_t>(std::clamp(std::lround(scale * 4096.0), 1L, 65535L));
  instance.variety = static_cast<std::uint8_t>(core::random_bits(plan_.seed, kColour, id));
  instance.coarsest_level = static_cast<std::int8_t>(
      last_level_on_land(site_, foot_world.head<2>(), foot_world.z(), first_level,
                         std::min(coarsest_level, model.coarsest_level)));
  objects_.instances.push_back(instance);
}

void PlantSink::add(std::uint32_t id, const PlantModel& model, const Vector2d& place_world,
                    std::uint16_t heading, double scale, int coarsest_level) {
  add(id, model, Vector3d(place_world.x(), place_world.y(), site_.ground_z_world(place_world)),
      heading, scale, coarsest_level);
}

}  // namespace terracast::tiler
