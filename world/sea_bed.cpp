#include "world/sea_bed.h"

#include "core/noise.h"
#include "core/random.h"

namespace terracast::world::sea_bed {

std::uint32_t noise_seed(std::uint64_t world_seed) {
  return static_cast<std::uint32_t>(core::mix_bits(world_seed));
}

Noise noise_at(const core::Lanes3d& points_world, std::uint32_t seed) {
  core::NoisePlaces places;
  places.set(points_world, core::Lanes<double>{});
  const auto value = [&](const Band& band) {
    return core::sum_all_noise(places, band.coarsest_level, band.finest_level, seed + band.stream);
  };
  return {.patch = value(kPatch), .weed = value(kWeed)};
}

}  // namespace terracast::world::sea_bed
