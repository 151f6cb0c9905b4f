#include <array>

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

}  // namespace terracast::world_export
