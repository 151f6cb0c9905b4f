#include "tiler/roads/road_tags.h"

#include "tiler/roads/way_style.h"

namespace terracast::tiler {
namespace {

constexpr auto kNames = known_names(kAllRoadTags, kIgnoredTags);

}  // namespace

TagTable road_tag_table() { return {"roads", kAllRoadTags, kNames}; }

bool is_highway_word(std::string_view word) {
  // Ways and squares, then what is no way and is passed over.
  return is_road_class(word) ||
         is_one_of(word,
                   "track|pedestrian|footway|cycleway|bridleway|steps|path|corridor|crossing") ||
         is_one_of(
             word,
             "proposed|construction|planned|abandoned|razed|disused|platform|bus_stop|street_lamp|"
             "traffic_signals|stop|give_way|turning_circle|turning_loop|motorway_junction|"
             "mini_roundabout|passing_place|elevator|rest_area|services|speed_camera|milestone|"
             "traffic_mirror|toll_gantry|emergency_access_point|emergency_bay|escape|raceway|"
             "via_ferrata|cyclist_waiting_aid|trailhead|traffic_calming");
}

bool is_oneway_word(std::string_view word) {
  return flag_from_tag(word) || is_one_of(word, "-1|reverse|reversible|alternating");
}

bool is_access_word(std::string_view word) {
  return flag_from_tag(word) ||
         is_one_of(
             word,
             "private|permissive|permit|destination|designated|official|delivery|customers|"
             "agricultural|forestry|emergency|residents|military|restricted|limited|discouraged|"
             "unknown|public");
}

bool is_sidewalk_word(std::string_view word) {
  return flag_from_tag(word) || is_one_of(word, "both|left|right|none|separate");
}

}  // namespace terracast::tiler
