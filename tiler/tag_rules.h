#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/ledger.h"
#include "tiler/feature_tags.h"
#include "tiler/tag_values.h"

/// Which tags a layer uses, and what their values may be. A layer asks for tags through TagsOf its table, so that no
/// code asks for a tag that is not in it: that does not compile.
namespace terracast::tiler {

enum class TagValue : std::uint8_t {
  Word,          ///< one of the words that are known
  Text,          ///< any
  Flag,          ///< yes or no, or a word that means yes
  Length,        ///< above 0
  LengthOrNone,  ///< 0 or above
  Count,         ///< 0 or above, parts of one too
  Level,         ///< any number
  Slope,
  Direction,
  Speed,
  Volts,
};

/// A tag that a layer uses.
struct TagRule {
  std::string_view name;
  TagValue value;
  std::string_view words;       ///< what it decides
  std::string_view known = {};  ///< words, parted by "|"; of a flag those that mean yes
  /// Of words that are too many to be listed. Neither this nor `known`: any word is understood.
  bool (*is_known)(std::string_view) = nullptr;
};

constexpr const TagRule* find_rule(std::span<const TagRule> rules, std::string_view name) {
  for (const TagRule& rule : rules)
    if (rule.name == name) return &rule;
  return nullptr;
}

/// Whether a value says something in the way of its tag.
bool understands(const TagRule& rule, std::string_view value);

/// The value of a flag; nullopt: not understood.
std::optional<bool> flag_of(const TagRule& rule, std::string_view value);
/// The value of a length, count, level or voltage; nullopt: not understood, or below what there is.
std::optional<Amount> amount_of(const TagRule& rule, std::string_view value);

/// Tables in one; a tag of several has one kind of values.
template <std::size_t... kSizes>
consteval auto joined_rules(const std::array<TagRule, kSizes>&... tables) {
  std::array<TagRule, (kSizes + ...)> all = {};
  std::size_t num = 0;
  const auto add = [&](const TagRule& rule) {
    const TagRule* known = find_rule(std::span<const TagRule>(all.data(), num), rule.name);
    if (known != nullptr && known->value != rule.value) throw "a tag of two kinds of values";
    all[num++] = rule;
  };
  (
      [&] {
        for (const TagRule& rule : tables) add(rule);
      }(),
      ...);
  return all;
}

/// What is known of tags: those that are used, then those that are ignored on purpose.
template <std::size_t kUsed, std::size_t kIgnored>
consteval auto known_names(const std::array<TagRule, kUsed>& used,
                           const std::array<core::KnownName, kIgnored>& ignored) {
  std::array<core::KnownName, kUsed + kIgnored> names = {};
  std::size_t num = 0;
  for (const TagRule& rule : used) names[num++] = {rule.name, rule.words, true};
  for (const core::KnownName& name : ignored) {
    if (name.is_used) throw "an ignored tag that is used";
    names[num++] = name;
  }
  return names;
}

/// What a layer knows of tags.
struct TagTable {
  std::string_view layer;
  std::span<const TagRule> rules;
  std::span<const core::KnownName> names;  ///< with those that are ignored
};

/// A feature's tags as a layer with a table of rules reads them. A key that is not in the table, or has values of another
/// kind, is an error of compilation. Values that are not understood are as none.
template <const auto& kRules>
class TagsOf {
 public:
  /// A tag of one of some kinds of values; of none: of any.
  template <TagValue... kValues>
  class Key {
   public:
    consteval Key(const char* name) : rule_(find_rule(kRules, name)) {
      if (rule_ == nullptr) throw "the layer's table has no such tag";
      if (sizeof...(kValues) > 0 && !((rule_->value == kValues) || ...))
        throw "the tag has values of another kind";
    }
    const TagRule& rule() const { return *rule_; }

   private:
    const TagRule* rule_;
  };
  using AnyKey = Key<>;
  using WordKey = Key<TagValue::Word, TagValue::Text>;
  using FlagKey = Key<TagValue::Flag>;
  using AmountKey = Key<TagValue::Length, TagValue::LengthOrNone, TagValue::Count, TagValue::Level,
                        TagValue::Volts>;

  TagsOf(const FeatureTags& tags) : tags_(&tags) {}
  const FeatureTags& all() const { return *tags_; }

  bool has(AnyKey key) const { return tags_->has(key.rule().name); }
  /// "": there is none.
  std::string_view value(WordKey key) const { return tags_->value(key.rule().name); }
  std::optional<bool> flag(FlagKey key) const {
    const std::string* text = tags_->find(key.rule().name);
    return text == nullptr ? std::nullopt : flag_of(key.rule(), *text);
  }
  bool is_yes(FlagKey key) const { return flag(key).value_or(false); }
  /// The word that says how it is so; "": there is none.
  std::string_view word(FlagKey key) const { return tags_->value(key.rule().name); }
  std::optional<Amount> amount(AmountKey key) const {
    const std::string* text = tags_->find(key.rule().name);
    return text == nullptr ? std::nullopt : amount_of(key.rule(), *text);
  }
  /// Of several values.
  std::optional<double> middle(AmountKey key) const {
    const auto found = amount(key);
    return found ? std::optional(found->middle()) : std::nullopt;
  }
  std::optional<double> most(AmountKey key) const {
    const auto found = amount(key);
    return found ? std::optional(found->highest) : std::nullopt;
  }
  std::optional<double> slope_deg(Key<TagValue::Slope> key) const {
    return slope_deg_from_tag(tags_->value(key.rule().name));
  }
  std::optional<double> direction_deg(Key<TagValue::Direction> key) const {
    return direction_deg_from_tag(tags_->value(key.rule().name));
  }
  std::optional<double> speed_kmph(Key<TagValue::Speed> key) const {
    return speed_kmph_from_tag(tags_->value(key.rule().name));
  }

 private:
  const FeatureTags* tags_;
};

}  // namespace terracast::tiler
