#include "tiler/vector_parts.h"

#include <gdal_priv.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "tiler/gdal_support.h"

namespace terracast::tiler {

using Eigen::Vector2d;

Box box_of(const std::vector<std::vector<PointsWorld>>& parts) {
  Box box;
  for (const auto& part : parts)
    for (const PointsWorld& line : part)
      for (const Vector2d& at : line) box.add(at);
  return box;
}

PointsWorld cut(const PointsWorld& line, int axis, double limit, double side, bool is_ring) {
  PointsWorld kept;
  const std::size_t count = line.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Vector2d& at = line[i];
    const bool is_in = side * (at[axis] - limit) <= 0.0;
    if (is_in) kept.push_back(at);
    if (i + 1 == count && !is_ring) break;
    const Vector2d& next = line[(i + 1) % count];
    if (is_in != (side * (next[axis] - limit) <= 0.0)) {
      Vector2d crossing = at + (next - at) * ((limit - at[axis]) / (next[axis] - at[axis]));
      crossing[axis] = limit;
      kept.push_back(crossing);
    }
  }
  return kept;
}

void unpack_tags(std::string_view packed, std::vector<std::pair<std::string, std::string>>& tags) {
  std::size_t at = 0;
  const auto quoted = [&](std::string& text) {
    while (at < packed.size() && packed[at] != '"') ++at;
    if (at++ >= packed.size()) return false;
    for (; at < packed.size() && packed[at] != '"'; ++at) {
      if (packed[at] == '\\' && at + 1 < packed.size()) ++at;
      text += packed[at];
    }
    return at++ < packed.size();
  };
  while (true) {
    std::string key;
    std::string value;
    if (!quoted(key)) return;
    if (packed.substr(at, 2) != "=>") return;
    if (!quoted(value)) return;
    tags.emplace_back(std::move(key), std::move(value));
  }
}

std::optional<std::uint64_t> whole_number(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::optional<std::uint64_t> feature_number(std::string_view text) {
  if (const auto number = whole_number(text)) return number;
  const std::size_t digits = text.find_first_of("0123456789");
  if (digits == std::string_view::npos) return std::nullopt;
  const std::string_view word = text.substr(0, digits);
  const auto id = whole_number(text.substr(digits));
  if (!id) return std::nullopt;
  if (word == "node/" || word == "n") return osm_number(OsmKind::Node, *id);
  if (word == "way/" || word == "w") return osm_number(OsmKind::Way, *id);
  if (word == "relation/" || word == "r") return osm_number(OsmKind::Relation, *id);
  return std::nullopt;
}

}  // namespace terracast::tiler
