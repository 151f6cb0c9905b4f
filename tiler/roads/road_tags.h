#pragma once

#include <array>

#include "tiler/common_tags.h"
#include "tiler/out_of_sight.h"
#include "tiler/tag_rules.h"

namespace terracast::tiler {

// Whether words are among those that are known.
bool is_highway_word(std::string_view word);
bool is_surface_word(std::string_view word);
bool is_oneway_word(std::string_view word);
bool is_access_word(std::string_view word);
bool is_sidewalk_word(std::string_view word);

/// Tags that the layer of roads uses.
inline constexpr auto kRoadTags = std::to_array<TagRule>({
    {"highway", TagValue::Word, "which road, path, crossing or square it is", {}, is_highway_word},
    {"railway", TagValue::Word, "which railway it is"},
    {"aeroway", TagValue::Word, "runways, taxiways, aprons, aerodromes"},
    {"man_made", TagValue::Word, "piers, breakwaters and quays"},
    {"amenity", TagValue::Word, "parking places"},
    {"place", TagValue::Word, "square: it is paved"},
    {"area:highway", TagValue::Word, "the area of a road"},
    {"area", TagValue::Flag, "that a closed way is an area, which is no way"},
    {"bridge", TagValue::Flag, "that a way is carried over what is below",
     "viaduct|aqueduct|boardwalk|cantilever|covered|low_water_crossing|movable|trestle|arch|swing|"
     "suspension|simple"},
    {"layer", TagValue::Level, "the order of bridges above each other"},
    {"maxspeed", TagValue::Speed, "speed of traffic and trains, 3 to 250 km/h"},
    {"access", TagValue::Word, "whether there is traffic", {}, is_access_word},
    {"vehicle", TagValue::Word, "whether there is traffic", {}, is_access_word},
    {"motor_vehicle", TagValue::Word, "whether there is traffic", {}, is_access_word},
    {"surface", TagValue::Word, "what it is paved with", {}, is_surface_word},
    {"oneway", TagValue::Word, "whether traffic runs one way, and which", {}, is_oneway_word},
    {"junction", TagValue::Word, "roundabout and circular run one way"},
    {"lanes", TagValue::Count,
     "lanes of both directions; of several the middle, from which parts of one widen it"},
    {"tracks", TagValue::Count, "tracks of a railway"},
    {"service", TagValue::Word, "how wide a service road is; which tracks are sidings"},
    {"width", TagValue::Length, "width of the paving; of several the middle"},
    {"sidewalk", TagValue::Word, "whether there are sidewalks", {}, is_sidewalk_word},
    {"sidewalk:both", TagValue::Word, "whether there are sidewalks", {}, is_sidewalk_word},
    {"tracktype", TagValue::Word, "what a track is paved with",
     "grade1|grade2|grade3|grade4|grade5"},
    {"footway", TagValue::Word, "crossing: its zebra is painted by the crossing's point"},
    {"parking", TagValue::Word, "multi-storey and rooftop: no parking place on the ground"},
    {"crossing", TagValue::Word, "whether a crossing is marked"},
    {"ref", TagValue::Text, "numbers that are painted on runways"},
});
using RoadTags = TagsOf<kRoadTags>;

inline constexpr auto kAllRoadTags = joined_rules(kRoadTags, kSightTags);
TagTable road_tag_table();

}  // namespace terracast::tiler
