#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

class OGRFeature;

namespace terracast::tiler {

/// Keys and values of a feature's fields, as text:
/// - a list of values is its values, parted by semicolons, as OpenStreetMap writes several values;
/// - yes and no of a field of flags;
/// - an object is its members, each under `field.member`; those of a field `tags` are tags themselves;
/// - objects and lists in more than eight others are kept as their text, and counted;
/// - `other_tags` and `all_tags` are unpacked.
/// is_osm         of GDAL's OSM driver, whose other fields repeat tags
/// num_too_deep   of these objects and lists; added to
std::vector<std::pair<std::string, std::string>> tags_of_fields(const OGRFeature& feature,
                                                                bool is_osm,
                                                                std::int64_t& num_too_deep);

}  // namespace terracast::tiler
