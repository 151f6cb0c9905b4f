#include "sensors/lidar/surfaces.h"

#include <algorithm>

#include "scene/ground/marking.h"

namespace terracast::sensors::lidar {

using core::SemanticClass;

void classify(const scene::Ground& ground, std::span<const world::WorldRay> rays,
              std::span<const world::SurfaceHit> hits,
              std::span<const world::SurfaceSample> surfaces, std::vector<SemanticClass>& classes) {
  classes.assign(rays.size(), SemanticClass::Sky);
  std::vector<std::size_t> plain;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].is_sky()) continue;
    if (!hits[i].is_ground())
      classes[i] = surfaces[i].finish.semantic_class;
    else if (surfaces[i].paint.is_painted)
      classes[i] = scene::class_of(surfaces[i].paint);
    else
      plain.push_back(i);
  }
  scene::GroundPlaces places;
  scene::GroundPacket packet;
  scene::Lanes<std::uint8_t> ids;
  for (std::size_t begin = 0; begin < plain.size(); begin += scene::kLanes) {
    const std::size_t count = std::min<std::size_t>(scene::kLanes, plain.size() - begin);
    for (std::size_t lane = 0; lane < scene::kLanes; ++lane) {
      const std::size_t i =
          plain[begin + std::min(lane, count - 1)];  // the last one fills the rest
      places.set(static_cast<int>(lane), rays[i].origin_world + hits[i].t * rays[i].direction_world,
                 hits[i].normal_world(), surfaces[i], 0.0);
    }
    ground.set(places, packet);
    ground.classify(packet, ids);
    for (std::size_t lane = 0; lane < count; ++lane)
      classes[plain[begin + lane]] = static_cast<SemanticClass>(ids[static_cast<int>(lane)]);
  }
}

}  // namespace terracast::sensors::lidar
