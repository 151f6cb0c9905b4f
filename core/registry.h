#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"

namespace terracast::core {

/// Edit distance (Levenshtein) between two words.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known name nearest to `name`, or empty when none is near (more than a third of the letters
/// differ).
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

/// "unknown exporter "kiti" (nearest: "kitti"; known: colmap, kitti, tartanair)"
std::string unknown_name_message(std::string_view what, std::string_view name,
                                 const std::vector<std::string>& known);

/// The names of a registry's table, in its order. Info has a member `name`.
template <class Info>
std::vector<std::string> registry_names(std::span<const Info> table) {
  std::vector<std::string> names;
  for (const Info& info : table) names.emplace_back(info.name);
  return names;
}

/// The entry called `name`.
/// throws Config when there is none, naming the nearest.
template <class Info>
const Info& find_registered(std::span<const Info> table, std::string_view what,
                            std::string_view name) {
  for (const Info& info : table)
    if (name == info.name) return info;
  fail(ErrorKind::Config, "{}", unknown_name_message(what, name, registry_names(table)));
}

}  // namespace terracast::core
