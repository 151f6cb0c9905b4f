#include <algorithm>
#include <charconv>
#include <cmath>

#include "geo/units.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {

FeatureTags::FeatureTags(std::vector<std::pair<std::string, std::string>> tags)
    : tags_(std::move(tags)) {
  std::stable_sort(tags_.begin(), tags_.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  tags_.erase(std::unique(tags_.begin(), tags_.end(),
                          [](const auto& a, const auto& b) { return a.first == b.first; }),
              tags_.end());
}

const std::string* FeatureTags::find(std::string_view key) const {
  const auto at =
      std::lower_bound(tags_.begin(), tags_.end(), key,
                       [](const auto& tag, std::string_view wanted) { return tag.first < wanted; });
  return at == tags_.end() || at->first != key ? nullptr : &at->second;
}

std::string_view FeatureTags::value(std::string_view key) const {
  const std::string* text = find(key);
  return text == nullptr ? std::string_view() : std::string_view(*text);
}

std::optional<double> FeatureTags::number(std::string_view key) const {
  std::string_view text = value(key);
  const auto skip_blanks = [&] {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  };
  skip_blanks();
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  skip_blanks();
  if (text.starts_with("'") || text.starts_with("ft") || text.starts_with("feet"))
    value = geo::metres_from_feet(value);
  return value;
}

}  // namespace terracast::tiler
