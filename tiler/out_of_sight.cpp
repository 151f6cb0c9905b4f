#include "tiler/out_of_sight.h"

namespace terracast::tiler {
namespace {

using SightTags = TagsOf<kSightTags>;

/// Whether tags say that a thing rises above the ground.
bool states_height(const SightTags& tags) {
  return tags.most("height") || tags.most("building:levels").value_or(0.0) > 0.0 ||
         tags.has("building:min_level") || tags.has("roof:levels") || tags.has("roof:shape");
}

bool is_cellar(const SightTags& tags) {
  const bool is_parking = tags.value("parking") == "underground";
  const bool has_cellars = tags.most("building:levels:underground").value_or(0.0) > 0.0;
  return (is_parking || has_cellars) && !states_height(tags);
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
  if (tags.is_yes("tunnel") || is_all_below_0(tags.amount("level"))) return Sight::BelowGround;
  if (what != SightOf::Way && is_all_below_0(tags.amount("layer"))) return Sight::BelowGround;
  if ((what == SightOf::Body || what == SightOf::Area) && is_cellar(tags))
    return Sight::BelowGround;
  return tags.is_yes("covered") ? Sight::Covered : Sight::Open;
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
