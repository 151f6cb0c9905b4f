#pragma once

#include <array>

#include "tiler/common_tags.h"
#include "tiler/out_of_sight.h"
#include "tiler/roads/road_tags.h"
#include "tiler/tag_rules.h"

namespace terracast::tiler {

/// Tags that the rules of the layer of objects use, beside those by which they know roads as the layer of roads does.
inline constexpr auto kObjectTags = std::to_array<TagRule>({
    {"highway", TagValue::Word, "traffic and lamps of roads"},
    {"power", TagValue::Word, "lines, their pylons, wind turbines"},
    {"man_made", TagValue::Word, "masts, towers, tanks, silos, cranes, chimneys, lighthouses"},
    {"ship", TagValue::Word, "a ship, and its kind",
     "yes|container|feeder|bulk|bulk_carrier|tanker|ferry|passenger|cargo|fishing|sailing|yacht|"
     "boat"},
    {"seamark:type", TagValue::Word, "moorings, berths and anchorages"},
    {"leisure", TagValue::Word, "marina: boats and jetties"},
    {"harbour", TagValue::Word, "features of harbours are looked at"},
    {"mooring", TagValue::Word, "a boat lies there"},
    {"barrier", TagValue::Word, "hedges, fences and walls"},
    {"aeroway", TagValue::Word, "stands, bridges, hangars and the strips round runways"},
    {"amenity", TagValue::Word, "parked cars, loading docks"},
    {"landuse", TagValue::Word, "ports: containers and cranes"},
    {"industrial", TagValue::Word, "ports and container yards"},
    {"port", TagValue::Word, "container: a terminal"},
    {"building", TagValue::Word,
     "hangars and warehouses that are points; what has an outline is left to buildings"},
    {"width", TagValue::Length, "of hedges, streets and runways"},
    {"height", TagValue::Length, "of masts, towers and the like"},
    {"diameter", TagValue::Length, "of tanks and silos"},
    {"direction", TagValue::Direction, "where a thing faces"},
    {"parking", TagValue::Word, "which parking places are open to the sky"},
    {"generator:source", TagValue::Word, "wind: a turbine"},
    {"generator:method", TagValue::Word, "wind_turbine: a turbine"},
    {"crane:type", TagValue::Word, "which crane it is"},
    {"tower:type", TagValue::Word, "which tower it is"},
    {"service", TagValue::Word, "aircraft_control: a control tower"},
    {"voltage", TagValue::Volts, "which pylons a line has; of several the most"},
    {"lit", TagValue::Flag, "whether there are lamps",
     "24/7|automatic|interval|limited|operating_times|sunset-sunrise|dusk-dawn"},
    {"bridge", TagValue::Flag, "no traffic stands on bridges",
     "viaduct|aqueduct|boardwalk|cantilever|covered|low_water_crossing|movable|trestle|arch|swing|"
     "suspension|simple"},
    {"area", TagValue::Flag, "no traffic runs on areas"},
});
using ObjectTags = TagsOf<kObjectTags>;

inline constexpr auto kAllObjectTags = joined_rules(kObjectTags, kRoadTags, kSightTags);
TagTable object_tag_table();

}  // namespace terracast::tiler
