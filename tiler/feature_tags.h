#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terracast::tiler {

/// What a source says of a feature: keys and values as text, sorted by key, each key once. What the
/// source packs into one field (`other_tags`) is unpacked. A value without letters is none; blanks at a value's ends are
/// left out. Layers read them through TagsOf their table (tiler/tag_rules.h).
class FeatureTags {
 public:
  FeatureTags() = default;
  /// Of two with the same key the first stays.
  explicit FeatureTags(std::vector<std::pair<std::string, std::string>> tags);

  /// nullptr: there is none.
  const std::string* find(std::string_view key) const;
  /// "": there is none.
  std::string_view value(std::string_view key) const;
  bool has(std::string_view key) const { return find(key) != nullptr; }

  const std::vector<std::pair<std::string, std::string>>& all() const { return tags_; }
  bool operator==(const FeatureTags&) const = default;

 private:
  std::vector<std::pair<std::string, std::string>> tags_;
};

}  // namespace terracast::tiler
