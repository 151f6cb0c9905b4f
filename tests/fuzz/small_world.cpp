#include "tests/fuzz/small_world.h"

#include "tiler/layer_stack.h"

namespace terracast::fuzz {
namespace {

std::shared_ptr<const tiler::WorldSurface> prepare_plane() {
  tiler::WorldOptions options;
  options.origin_lat_deg = kOriginLat_deg;
  options.origin_lon_deg = kOriginLon_deg;
  options.size_m = kSize_m;
  tiler::ElevationOptions plane;
  plane.kind = "plane";
  plane.vertical_datum = "ellipsoid";
  plane.height_m = 800.0;
  options.elevation.push_back(plane);
  const core::Log log("fuzz", core::LogLevel::Off);
  return tiler::WorldSurface::prepare(options, {.log = log, .num_threads = 1, .events_file = {}});
}

}  // namespace

SmallWorld::SmallWorld()
    : log_("fuzz", core::LogLevel::Off),
      surface_([] {
        static const std::shared_ptr<const tiler::WorldSurface> made = prepare_plane();
        return made;
      }()),
      context_{.log = log_, .num_threads = 1, .events_file = {}} {}

tiler::LayerInputs SmallWorld::inputs() const {
  return {.frame = surface_->frame(),
          .size_m = surface_->options().size_m,
          .seed = 1,
          .surface = *surface_,
          .earlier = {},
          .ids = ids_,
          .country = {},
          .licence = {},
          .accuracy = {},
          .context = context_};
}

}  // namespace terracast::fuzz
