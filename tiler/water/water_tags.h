#pragma once

#include <array>

#include "tiler/common_tags.h"
#include "tiler/out_of_sight.h"
#include "tiler/tag_rules.h"

namespace terracast::tiler {

/// Tags that the layer of water uses.
inline constexpr auto kWaterTags = std::to_array<TagRule>({
    {"waterway", TagValue::Word, "rivers, canals, streams, ditches, and areas of rivers and docks"},
    {"natural", TagValue::Word, "water: an area of it"},
    {"landuse", TagValue::Word, "reservoir and basin: areas of water"},
    {"water", TagValue::Word, "river, stream and canal: its level falls along it"},
    {"width", TagValue::Length, "width of a line; of several the middle"},
    {"est_width", TagValue::Length, "width of a line, where width says none"},
    {"intermittent", TagValue::Flag, "the bed is dry but for some weeks"},
    {"seasonal", TagValue::Flag, "the bed is dry but for some weeks",
     "spring|summer|autumn|fall|winter|wet_season|dry_season|monsoon"},
    {"name", TagValue::Text, "which lines are one river"},
});
using WaterTags = TagsOf<kWaterTags>;

inline constexpr auto kAllWaterTags = joined_rules(kWaterTags, kSightTags);
TagTable water_tag_table();

}  // namespace terracast::tiler
