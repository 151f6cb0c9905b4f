#include "tiler/buildings/building_tags.h"

namespace terracast::tiler {
namespace {

constexpr auto kNames = known_names(kAllBuildingTags, kIgnoredTags);

/// Any word says that there is one, but no in all its spellings.
bool is_there(std::string_view value) { return !value.empty() && flag_from_tag(value) != false; }

}  // namespace

TagTable building_tag_table() { return {"buildings", kAllBuildingTags, kNames}; }

bool is_tagged_part(const FeatureTags& tags) {
  return is_there(BuildingTags(tags).value("building:part"));
}

bool is_tagged_building(const FeatureTags& tags) {
  return is_there(BuildingTags(tags).value("building")) || is_tagged_part(tags);
}

}  // namespace terracast::tiler
