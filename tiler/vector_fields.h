#pragma once

#include <string>
#include <utility>
#include <vector>

class OGRFeature;

namespace terracast::tiler {

/// Keys and values of a feature's fields, as text:
/// - a list of values is its values, parted by semicolons, as OpenStreetMap writes several values;
/// - yes and no of a field of flags;
/// - an object is its members, each under `field.member`; those of a field `tags` are tags themselves;
/// - `other_tags` and `all_tags` are unpacked.
/// is_osm   of GDAL's OSM driver, whose other fields repeat tags
std::vector<std::pair<std::string, std::string>> tags_of_fields(const OGRFeature& feature,
                                                                bool is_osm);

}  // namespace terracast::tiler
