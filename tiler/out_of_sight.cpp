#include "tiler/out_of_sight.h"

namespace terracast::tiler {
namespace {

using SightTags = TagsOf<kSightTags>;

/// Whether tags say that a thing rises above the ground.
bool states_height(const SightTags& tags) {
  using Key = SightTags::AmountKey;
  for (const Key& key : {Key("height"), Key("building:levels"), Key("building:min_level"),
                         Key("min_height"), Key("roof:levels"), Key("roof:height")})
    if (tags.most(key).value_or(0.0) > 0.0) return true;
  // A flat roof may be the ground above a cellar.
  return tags.has("roof:shape") && tags.value("roof:shape") != "flat";
}

/// Of what states no height above the ground.
bool is_cellar(const SightTags& tags) {
  if (tags.value("parking") == "underground") return true;
  const std::optional<double> storeys = tags.most("building:levels");
  return storeys && *storeys == 0.0 && tags.most("building:levels:underground").value_or(0.0) > 0.0;
}

bool is_all_below_0(const std::optional<Amount>& levels) { return levels && levels->highest < 0.0; }

}  // namespace

Sight sight_of(const FeatureTags& all, SightOf what) {
  const SightTags tags(all);
  const std::string_view location = tags.value("location");
  if (tags.is_yes("indoor") || tags.value("highway") == "corridor" ||
      is_one_of(location, "indoor|indoors"))
    return Sight::Indoors;
  if (is_one_of(location, "underground|subterranean|below_ground")) return Sight::BelowGround;
  if (is_one_of(location, "underwater|undersea")) return Sight::BelowWater;
  const bool is_tunnel = tags.is_yes("tunnel");
  const bool is_roofed =
      is_one_of(tags.word("tunnel"), "building_passage|avalanche_protector|covered");
  if (is_tunnel && !is_roofed) return Sight::BelowGround;
  const bool rises = states_height(tags);
  if (is_all_below_0(tags.amount("level")) && !(what == SightOf::Building && rises))
    return Sight::BelowGround;
  const bool is_line = what == SightOf::Way || what == SightOf::Waterway;
  if (!is_line && !rises && is_cellar(tags)) return Sight::BelowGround;
  const bool is_covered = is_tunnel || tags.is_yes("covered");
  if (is_covered && is_all_below_0(tags.amount("layer"))) return Sight::BelowGround;
  return is_covered && what != SightOf::Building ? Sight::Covered : Sight::Open;
}

bool HiddenCounts::is_hidden(const FeatureTags& tags, SightOf what) {
  const Sight sight = sight_of(tags, what);
  if (sight != Sight::Open) add(sight);
  return sight != Sight::Open;
}

void HiddenCounts::append_to(std::vector<std::pair<std::string, std::int64_t>>& counts) const {
  static constexpr std::string_view kNames[kNumSights] = {
      "", "below ground, left out", "below water, left out", "indoors, left out",
      "under a cover, left out"};
  for (std::size_t i = 1; i < nums_.size(); ++i)
    if (nums_[i] > 0) counts.emplace_back(kNames[i], nums_[i]);
}

}  // namespace terracast::tiler
