#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "tiler/vector_source.h"

namespace terracast::tiler {

/// Among LayerInfo::counts: of how many features the number is osm_number().
inline constexpr std::string_view kOsmCount = "features numbered by OpenStreetMap";

/// The element of OpenStreetMap ("way/262902069") that a feature's number stands for; nothing of a number that
/// osm_number() gives to no element there is: ids have stayed below 2^44.
inline std::optional<std::string> osm_element(std::uint64_t number) {
  constexpr std::uint64_t kMostIds = std::uint64_t{1} << 44;
  const std::uint64_t id = number & ((std::uint64_t{1} << 60) - 1);
  if (id >= kMostIds) return std::nullopt;
  for (const auto& [kind, name] : {std::pair(OsmKind::Node, "node"), std::pair(OsmKind::Way, "way"),
                                   std::pair(OsmKind::Relation, "relation")})
    if (number == osm_number(kind, id)) return fmt::format("{}/{}", name, id);
  return std::nullopt;
}

}  // namespace terracast::tiler
