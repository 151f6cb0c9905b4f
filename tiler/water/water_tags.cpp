#include "tiler/water/water_tags.h"

namespace terracast::tiler {
namespace {

constexpr auto kNames = known_names(kAllWaterTags, kIgnoredTags);

}  // namespace

TagTable water_tag_table() { return {"water", kAllWaterTags, kNames}; }

}  // namespace terracast::tiler
