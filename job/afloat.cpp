#include "job/afloat.h"

#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace terracast::job {
namespace {

using Eigen::Vector2d;

/// A shore is off by what a tile's cells measure, which are tens of metres wide where they are seen from far.
constexpr std::array kRings_m = {5.0, 10.0, 20.0, 40.0, 80.0, 160.0};
constexpr int kPlacesOnRing = 16;

bool has_water_near(const Vector2d& place_world, const tiler::WorldSurface& surface) {
  const auto is_water = [&](const Vector2d& at) {
    return world::is_water(surface.sample(at.x(), at.y()).cover);
  };
  if (is_water(place_world)) return true;
  for (const double ring_m : kRings_m)
    for (int i = 0; i < kPlacesOnRing; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kPlacesOnRing;
      if (is_water(place_world + ring_m * Vector2d(std::cos(angle), std::sin(angle)))) return true;
    }
  return false;
}

}  // namespace

void check_afloat(std::span<const render::MovingThing> things, const tiler::WorldSurface& surface) {
  for (const render::MovingThing& thing : things) {
    if (thing.ride != render::Ride::Water) continue;
    for (std::size_t frame = 0; frame < thing.states.size(); ++frame) {
      if (!thing.states[frame]) continue;
      const Vector2d place = thing.states[frame]->world_from_body.translation.head<2>();
      if (!has_water_near(place, surface))
        core::fail(core::ErrorKind::Input,
                   "{} at frame {}: it rides the water, and at x {:.1f} m, y {:.1f} m of the world "
                   "there is none, nor within {} m; lead it over water, or set ride",
                   thing.name, frame, place.x(), place.y(), kRings_m.back());
    }
  }
}

}  // namespace terracast::job
