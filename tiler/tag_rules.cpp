#include "tiler/tag_rules.h"

namespace terracast::tiler {

std::optional<bool> flag_of(const TagRule& rule, std::string_view value) {
  if (const auto flag = flag_from_tag(value)) return flag;
  if (is_one_of(value, rule.known)) return true;
  return std::nullopt;
}

std::optional<Amount> amount_of(const TagRule& rule, std::string_view value) {
  const bool is_length = rule.value == TagValue::Length || rule.value == TagValue::LengthOrNone;
  const std::optional<Amount> amount = is_length                       ? length_from_tag(value)
                                       : rule.value == TagValue::Volts ? volts_from_tag(value)
                                                                       : count_from_tag(value);
  if (!amount || rule.value == TagValue::Level) return amount;
  const bool may_be_none = rule.value == TagValue::LengthOrNone || rule.value == TagValue::Count;
  // A circuit that is not used has 0 volts.
  if (rule.value == TagValue::Volts)
    return amount->highest > 0.0 && amount->lowest >= 0.0 ? amount : std::nullopt;
  const bool is_one = amount->lowest > 0.0 || (may_be_none && amount->lowest == 0.0);
  return is_one ? amount : std::nullopt;
}

bool understands(const TagRule& rule, std::string_view value) {
  switch (rule.value) {
    case TagValue::Text:
      return true;
    case TagValue::Word:
      if (rule.known.empty() && rule.is_known == nullptr) return true;
      return is_one_of(value, rule.known) || (rule.is_known != nullptr && rule.is_known(value));
    case TagValue::Flag:
      return flag_of(rule, value).has_value();
    case TagValue::Slope:
      return slope_deg_from_tag(value).has_value();
    case TagValue::Direction:
      return direction_deg_from_tag(value).has_value();
    case TagValue::Speed:
      return speed_kmph_from_tag(value).has_value();
    default:
      return amount_of(rule, value).has_value();
  }
}

}  // namespace terracast::tiler
