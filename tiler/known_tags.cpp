#include "tiler/known_tags.h"

#include "tiler/buildings/building_tags.h"
#include "tiler/objects/object_tags.h"
#include "tiler/roads/road_tags.h"
#include "tiler/water/water_tags.h"

namespace terracast::tiler {

std::vector<core::KnownTable> known_tag_tables() {
  std::vector<core::KnownTable> tables;
  for (const TagTable& table :
       {building_tag_table(), road_tag_table(), water_tag_table(), object_tag_table()})
    tables.push_back({table.layer, "tags of features", table.names});
  return tables;
}

}  // namespace terracast::tiler
