#include "tiler/feature_tags.h"

#include <algorithm>

namespace terracast::tiler {

FeatureTags::FeatureTags(std::vector<std::pair<std::string, std::string>> tags)
    : tags_(std::move(tags)) {
  constexpr std::string_view kBlanks = " \t\r\n";
  for (auto& [key, value] : tags_) {
    value.erase(value.find_last_not_of(kBlanks) + 1);
    value.erase(0, std::min(value.find_first_not_of(kBlanks), value.size()));
  }
  // A field that is there and empty is no tag.
  std::erase_if(tags_, [](const auto& tag) { return tag.second.empty(); });
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

}  // namespace terracast::tiler
