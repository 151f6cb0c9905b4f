#include "capture/channel.h"

#include <array>
#include <cmath>

namespace terracast::capture {

std::span<const ChannelInfo> channels() {
  static constexpr std::array<ChannelInfo, 9> kChannels = {{
      {"range_m", "float", "m",
       "distance along the ray through the pixel's centre; NaN where no ray comes in", "+inf"},
      {"normal.x", "half", "", "unit normal of the surface, world x (east)", "0"},
      {"normal.y", "half", "", "unit normal of the surface, world y (north)", "0"},
      {"normal.z", "half", "", "unit normal of the surface, world z (up at the origin)", "0"},
      {"semantic_id", "uint", "", "semantic class, by number", "0"},
      {"instance_id", "uint", "", "object; 0 is the ground", "0"},
      {"primitive_id", "uint", "",
       "ground: tile index << 17 | cell y << 9 | cell x << 1 | upper triangle; object: 32767 << 17 "
       "| "
       "triangle modulo 131071",
       "4294967295"},
      {"flags", "uint", "",
       "bit 0 edge, 1 visible in the next frame, 2 in the previous one, 8 + k in camera k", "0"},
      {"bottom_range_m", "float", "m",
       "the same straight ray in the world without water: where it meets the bed of the sea, of a "
       "lake or of a river; range_m where it meets no water",
       "+inf", true},
  }};
  return kChannels;
}

std::span<const FlagGroup> flag_groups() {
  static constexpr std::array<FlagGroup, 4> kGroups = {{{"edge", kEdge},
                                                        {"next", kVisibleNext},
                                                        {"previous", kVisiblePrevious},
                                                        {"cameras", ~(visible_in_camera(0) - 1U)}}};
  return kGroups;
}

bool agree(float range_m, std::uint32_t semantic_id) {
  if (semantic_id >= semantic_class_names().size()) return false;
  switch (static_cast<SemanticClass>(semantic_id)) {
    case SemanticClass::Sky:
      return range_m == kSkyRange_m;
    case SemanticClass::Nothing:
      return std::isnan(range_m);
    default:
      return range_m > 0.0F && std::isfinite(range_m);
  }
}

}  // namespace terracast::capture
