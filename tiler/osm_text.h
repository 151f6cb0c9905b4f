#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

/// The text of .osm files, as far as its elements and their attributes go.
namespace terracast::tiler {

/// Of an element, what stands between < and >; "": there is none.
std::string_view osm_attribute(std::string_view element, std::string_view name);
/// nullopt: there is none, or it is no whole number.
std::optional<std::int64_t> osm_number_in(std::string_view element, std::string_view name);
/// "/node" of </node>.
std::string_view osm_element_name(std::string_view element);
/// Where the element that begins behind a < at a text's front ends, at its >; npos: not in this text.
std::size_t end_of_osm_element(std::string_view text);

}  // namespace terracast::tiler
