#include "tiler/vegetation/plant_sink.h"

#include <algorithm>
#include <cmath>

#include "tiler/shown_ground.h"
#include "world/tile_id.h"

namespace terracast::tiler {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// As world::Instance::variety draws colours: how light in its lower four bits, how warm in the upper.
std::uint8_t variety_of(const Tint& tint, std::uint64_t drawn) {
  constexpr double kMiddle = 7.5;
  const auto sixteenth = [&](std::uint64_t own, double others) {
    const double value =
        (1.0 - tint.shared) * (static_cast<double>(own) / kMiddle - 1.0) + tint.shared * others;
    return static_cast<unsigned>(std::clamp(std::lround(kMiddle * (1.0 + value)), 0L, 15L));
  };
  return static_cast<std::uint8_t>(sixteenth(drawn & 15U, tint.light) |
                                   sixteenth(drawn >> 4U & 15U, tint.warm) << 4U);
}

}  // namespace

int last_level_on_land(const LayerSite& site, const Vector2d& place_world, double foot_z_world,
                       int first_level, int last_level) {
  const int last = last_level_with_ground(site, place_world, foot_z_world, first_level, last_level);
  // What grows has more room than samples of finer tiles are apart.
  for (int level = std::max(first_level, 0); level <= last; ++level)
    if (is_amid_water(site, place_world, level)) return level - 1;
  return last;
}

int last_level_on_bed(const LayerSite& site, const BedSite& bed, const Vector2d& place_world,
                      double bed_z_world, double within_m, int first_level, int last_level) {
  const auto z_world = [&](const Vector2d& sample) {
    return site.ground_z_world(sample) - bed.water_depth_m(sample);
  };
  for (int level = std::max(first_level, 0); level <= last_level; ++level) {
    if (!is_amid_water(site, place_world, level)) return level - 1;
    const double shown_z = shown_z_world(z_world, place_world, level);
    if (std::abs(shown_z - bed_z_world) > within_m) return level - 1;
  }
  return last_level;
}

void PlantSink::add(const Planting& planting, const Vector3d& foot_world) {
  add(planting, foot_world,
      last_level_on_land(site_, foot_world.head<2>(), foot_world.z(), planting.first_level,
                         std::min(planting.coarsest_level, planting.model.coarsest_level)));
}

void PlantSink::add_on_bed(const Planting& planting, const BedSite& bed,
                           const Vector2d& place_world, double water_depth_m) {
  const double bed_z = site_.ground_z_world(place_world) - water_depth_m;
  add(planting, Vector3d(place_world.x(), place_world.y(), bed_z - planting.lowered_m),
      last_level_on_bed(site_, bed, place_world, bed_z, planting.scale * planting.model.sunk_m,
                        planting.first_level,
                        std::min(planting.coarsest_level, planting.model.coarsest_level)));
}

void PlantSink::add(const Planting& planting, const Vector3d& foot_world, int last_level) {
  world::Instance instance;
  instance.provenance.instance_id = planting.id;
  instance.provenance.feature = planting.id;
  instance.prototype = planting.model.prototype;
  instance.place_steps =
      (foot_world / world::kHeightStep_m).array().round().cast<std::int32_t>().matrix();
  instance.heading = planting.heading;
  instance.scale =
      static_cast<std::uint16_t>(std::clamp(std::lround(planting.scale * 4096.0), 1L, 65535L));
  instance.variety = variety_of(planting.tint, core::random_bits(plan_.seed, kColour, planting.id));
  instance.coarsest_level = static_cast<std::int8_t>(last_level);
  objects_.instances.push_back(instance);
}

void PlantSink::add(const Planting& planting, const Vector2d& place_world) {
  add(planting, Vector3d(place_world.x(), place_world.y(), site_.ground_z_world(place_world)));
}

}  // namespace terracast::tiler
