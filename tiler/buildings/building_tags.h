#pragma once

#include <array>

#include "tiler/common_tags.h"
#include "tiler/out_of_sight.h"
#include "tiler/tag_rules.h"

namespace terracast::tiler {

// Whether words are among those that are known.
bool is_building_word(std::string_view word);
bool is_roof_shape_word(std::string_view word);
bool is_wall_material_word(std::string_view word);
bool is_roof_material_word(std::string_view word);
bool is_color_word(std::string_view word);

/// Tags that the layer of buildings uses.
inline constexpr auto kBuildingTags = std::to_array<TagRule>({
    {"building",
     TagValue::Word,
     "that a building stands there, and its kind",
     {},
     is_building_word},
    {"building:part",
     TagValue::Word,
     "that it is a part of one, and its kind",
     {},
     is_building_word},
    {"amenity", TagValue::Word, "place_of_worship: a church, where building says no kind"},
    {"shop", TagValue::Word, "a shop, where building says no kind"},
    {"man_made", TagValue::Word,
     "storage_tank and silo: a tower; pier, breakwater and quay are left to a layer of roads"},
    {"height", TagValue::Length, "height with the roof; of several the highest"},
    {"min_height", TagValue::LengthOrNone, "where a part begins"},
    {"building:levels", TagValue::Count, "storeys below the roof; of several the most"},
    {"building:min_level", TagValue::Count, "storeys below a part, where min_height is not there"},
    {"roof:levels", TagValue::Count,
     "storeys in the roof, where roof:height and roof:angle are not there"},
    {"roof:shape", TagValue::Word, "shape of the roof", {}, is_roof_shape_word},
    {"roof:height", TagValue::LengthOrNone, "height of the roof above the eaves"},
    {"roof:angle", TagValue::Slope, "slope of the roof, where roof:height is not there"},
    {"roof:direction", TagValue::Direction, "where a skillion roof falls to"},
    {"roof:orientation", TagValue::Word, "across: the ridge runs along the shorter side",
     "along|across"},
    {"roof:material", TagValue::Word, "material of the roof", {}, is_roof_material_word},
    {"roof:colour", TagValue::Word, "colour of the roof", {}, is_color_word},
    {"roof:color", TagValue::Word, "colour of the roof", {}, is_color_word},
    {"building:material", TagValue::Word, "material of the walls", {}, is_wall_material_word},
    {"building:colour", TagValue::Word, "colour of the walls", {}, is_color_word},
    {"building:color", TagValue::Word, "colour of the walls", {}, is_color_word},
    {"building:facade:colour", TagValue::Word, "colour of the walls", {}, is_color_word},
});
using BuildingTags = TagsOf<kBuildingTags>;

inline constexpr auto kAllBuildingTags = joined_rules(kBuildingTags, kSightTags);
TagTable building_tag_table();

/// Whether tags say that a building, or a part of one, stands there.
bool is_tagged_building(const FeatureTags& tags);
bool is_tagged_part(const FeatureTags& tags);

}  // namespace terracast::tiler
