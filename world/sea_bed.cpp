#include "world/sea_bed.h"

#include "core/noise.h"
#include "core/random.h"

namespace terracast::world::sea_bed {

std::uint32_t noise_seed(std::uint64_t world_seed) {
  return static_cast<std::uint32_t>(core::mix_bits(world_seed));
}

Noise noise_at(const Eigen::Vector3d& point_world, std::uint32_t seed) {
  core::Lanes3d points;
  core::Lanes<double> footprints_m;
  for (int lane = 0; lane < core::kLanes; ++lane) {
    for (std::size_t k = 0; k < 3; ++k) points[k][lane] = point_world[static_cast<int>(k)];
    footprints_m[lane] = 0.0;
  }
  core::NoisePlaces places;
  places.set(points, footprints_m);
  const auto value = [&](const Band& band) {
    return core::sum_all_noise(places, band.coarsest_level, band.finest_level,
                               seed + band.stream)[0];
  };
  return {.patch = value(kPatch), .weed = value(kWeed)};
}

}  // namespace terracast::world::sea_bed
