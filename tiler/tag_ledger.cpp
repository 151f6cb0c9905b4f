#include "tiler/tag_ledger.h"

#include <cstdint>
#include <string_view>
#include <unordered_map>

namespace terracast::tiler {

core::Ledger ledger_of_tags(std::span<const VectorFeature> features, const TagTable& table,
                            std::string_view number_field) {
  struct Met {
    const TagRule* rule = nullptr;
    std::int64_t times = 0;
  };
  core::Ledger ledger;
  std::unordered_map<std::string_view, Met> met;  // names are few, and features many
  for (const VectorFeature& feature : features)
    for (const auto& [name, value] : feature.tags.all()) {
      const auto [entry, is_new] = met.try_emplace(name);
      if (is_new) entry->second.rule = find_rule(table.rules, name);
      ++entry->second.times;
      const TagRule* rule = entry->second.rule;
      if (rule != nullptr && !understands(*rule, value)) ledger.misunderstand(name, value);
    }
  for (const auto& [name, one] : met)
    if (!number_field.empty() && name == number_field)
      ledger.use(name, one.times);
    else
      ledger.count(name, table.names, one.times);
  return ledger;
}

}  // namespace terracast::tiler
