#include <array>

#include "core/error.h"
#include "export/world/world_format.h"

// Every format, in alphabetical order: X(name) is export/world/name.cpp, which defines
// `WorldFormatInfo name_world_format()`.
#define TERRACAST_WORLD_FORMATS(X) X(geotiff) X(gltf) X(obj) X(tiles3d) X(vdb)

namespace terracast::world_export {

#define TERRACAST_DECLARE(name) WorldFormatInfo name##_world_format();
TERRACAST_WORLD_FORMATS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const WorldFormatInfo> world_formats() {
#define TERRACAST_ENTRY(name) name##_world_format(),
  static const std::array table = {TERRACAST_WORLD_FORMATS(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

void export_region(const WorldFormatInfo& format, WorldExportInputs inputs) {
  const Region clipped = clipped_to_square(inputs.store.manifest(), inputs.region);
  // Longitudes a turn away are the same.
  if (clipped.south_deg != inputs.region.south_deg ||
      clipped.north_deg != inputs.region.north_deg ||
      clipped.east_deg - clipped.west_deg < inputs.region.east_deg - inputs.region.west_deg - 1e-9)
    inputs.context.log.warn(
        "the region reaches beyond the world's square; written is what lies in it: latitudes "
        "{:.7f} "
        "to {:.7f}, longitudes {:.7f} to {:.7f}",
        clipped.south_deg, clipped.north_deg, clipped.west_deg, clipped.east_deg);
  inputs.region = clipped;
  try {
    format.write(inputs);
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Interrupted) throw;
    core::fail(core::ErrorKind::Interrupted,
               "stopped on request; the same command begins the export anew");
  }
}

}  // namespace terracast::world_export
