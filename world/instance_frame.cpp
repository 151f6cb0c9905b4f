#include "world/instance_frame.h"

#include <numbers>

#include "world/tile_id.h"

namespace terracast::world {

InstanceFrame instance_frame(const Instance& instance, const geo::WorldFrame& frame) {
  constexpr double kRadiansPerStep = 2.0 * std::numbers::pi / 65536.0;
  constexpr double kScalePerStep = 1.0 / 4096.0;
  const Eigen::Vector3d place_world = instance.place_steps.cast<double>() * kHeightStep_m;
  const Eigen::Quaterniond world_from_enu(frame.world_from_enu(place_world));
  const Eigen::Quaterniond enu_from_prototype(
      Eigen::AngleAxisd(instance.heading * kRadiansPerStep, Eigen::Vector3d::UnitZ()));
  return {.place_world = place_world,
          .world_from_prototype = (world_from_enu * enu_from_prototype).normalized(),
          .scale = instance.scale * kScalePerStep};
}

}  // namespace terracast::world
