#include "core/semantic_class.h"

#include <array>

namespace terracast::core {

std::span<const std::string_view> semantic_class_names() {
  static constexpr std::array<std::string_view, kNumSemanticClasses> kNames = {
      "sky",          "outside",    "sea",     "rock",         "scree",      "grass",
      "soil",         "sand",       "snow",    "forest_floor", "shrubland",  "cropland",
      "wetland",      "built_up",   "lake",    "river",        "seabed",     "road",
      "road_marking", "path",       "railway", "runway",       "taxiway",    "apron",
      "parking",      "building",   "bridge",  "wall",         "tree",       "bush",
      "plant",        "stone",      "car",     "van",          "truck",      "bus",
      "aircraft",     "helicopter", "ship",    "boat",         "container",  "warehouse",
      "hangar",       "pier",       "crane",   "pylon",        "power_line", "wind_turbine",
      "street_lamp",  "object",     "cloud"};
  return kNames;
}

}  // namespace terracast::core
