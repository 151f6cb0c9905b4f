#include "tiler/objects/object_tags.h"

namespace terracast::tiler {
namespace {

constexpr auto kNames = known_names(kAllObjectTags, kIgnoredTags);

}  // namespace

TagTable object_tag_table() { return {"objects", kAllObjectTags, kNames}; }

}  // namespace terracast::tiler
