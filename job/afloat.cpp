#include "job/afloat.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "core/error.h"

namespace terracast::job {
namespace {

using Eigen::Vector2d;

/// A shore is off by what a tile's cells measure, which are tens of metres wide where they are seen from far.
constexpr double kNear_m = 160.0;
/// What is as wide as this cannot hide between the places that are looked at.
constexpr double kSpacing_m = 5.0;

/// Every place of a grid that is near or beside what is, the nearest first.
std::vector<Vector2d> offsets_near() {
  std::vector<Vector2d> offsets;
  constexpr double kReach_m = kNear_m + kSpacing_m;
  constexpr int kReach = static_cast<int>(kReach_m / kSpacing_m);
  for (int y = -kReach; y <= kReach; ++y)
    for (int x = -kReach; x <= kReach; ++x)
      if (const Vector2d offset = kSpacing_m * Vector2d(x, y); offset.norm() <= kReach_m)
        offsets.push_back(offset);
  std::stable_sort(offsets.begin(), offsets.end(), [](const auto& one, const auto& other) {
    return one.squaredNorm() < other.squaredNorm();
  });
  return offsets;
}

class WaterSearch {
 public:
  explicit WaterSearch(const tiler::WorldSurface& surface)
      : surface_(surface), offsets_(offsets_near()) {}

  bool has_water_near(const Vector2d& place_world) {
    // What is ashore in one frame mostly is in the next, beside the same water.
    if ((seen_world_ - place_world).norm() <= kNear_m) return true;
    for (const Vector2d& offset : offsets_)
      if (const Vector2d at = place_world + offset;
          world::is_water(surface_.sample(at.x(), at.y()).cover)) {
        seen_world_ = at;
        return true;
      }
    return false;
  }

 private:
  const tiler::WorldSurface& surface_;
  std::vector<Vector2d> offsets_;
  Vector2d seen_world_ = Vector2d::Constant(std::numeric_limits<double>::infinity());  ///< none yet
};

}  // namespace

void check_afloat(std::span<const scene::MovingThing> things, const tiler::WorldSurface& surface) {
  WaterSearch search(surface);
  for (const scene::MovingThing& thing : things) {
    if (thing.ride != scene::Ride::Water) continue;
    for (std::size_t frame = 0; frame < thing.states.size(); ++frame) {
      if (!thing.states[frame]) continue;
      const Vector2d place = thing.states[frame]->world_from_body.translation.head<2>();
      if (!search.has_water_near(place))
        core::fail(core::ErrorKind::Input,
                   "{} at frame {}: it rides the water, and at x {:.1f} m, y {:.1f} m of the world "
                   "there is none, nor any {} m wide within {} m; lead it over water, or set ride",
                   thing.name, frame, place.x(), place.y(), kSpacing_m, kNear_m);
    }
  }
}

}  // namespace terracast::job
