#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tiler/tag_rules.h"

namespace terracast::tiler {

/// Whether a thing can be seen from outside.
enum class Sight : std::uint8_t { Open, BelowGround, BelowWater, Indoors, Covered };
inline constexpr int kNumSights = 5;

/// What a feature's shape stands for; the same tag may mean another thing of another.
enum class SightOf : std::uint8_t {
  Building,  ///< or a part of one
  Thing,     ///< an object that stands somewhere
  Area,      ///< on the ground: water, parking places, squares
  Way,       ///< roads, railways, paths
  Waterway,  ///< rivers, streams, ditches
};

/// Tags that say where a thing is.
inline constexpr auto kSightTags = std::to_array<TagRule>({
    {"location", TagValue::Word, "whether a thing is below ground, below water or indoors",
     "underground|subterranean|below_ground|underwater|undersea|overground|above_ground|overhead|"
     "surface|ground|"
     "indoor|indoors|outdoor|outdoors|roof|rooftop|wall|bridge|kiosk|platform|portal|street|"
     "overhead_line"},
    {"layer", TagValue::Level,
     "the order of what crosses; below 0 and under a cover: the thing is below ground"},
    {"level", TagValue::Level,
     "all below 0: the thing is below ground, but for buildings that state a height above it"},
    {"indoor", TagValue::Flag, "the thing is indoors",
     "room|area|wall|corridor|column|level|door|staircase|hall"},
    {"covered", TagValue::Flag,
     "the thing is under a roof or cover; a building stands nevertheless",
     "arcade|colonnade|building_passage|canopy|roof"},
    {"tunnel", TagValue::Flag,
     "the thing is below ground; building_passage, avalanche_protector and covered: under a cover",
     "building_passage|culvert|avalanche_protector|covered|flooded|cave|passage|underpass|canal"},
    {"highway", TagValue::Word, "which way or place it is; corridor: it is indoors"},
    {"parking", TagValue::Word,
     "underground: it is below ground; of parking places whether they are open"},
    {"building:levels:underground", TagValue::Count,
     "with building:levels = 0 and no height above the ground: it is below ground"},
    {"building:levels", TagValue::Count, "storeys, from which heights follow"},
    {"building:min_level", TagValue::Count, "where a part begins"},
    {"min_height", TagValue::LengthOrNone, "where a part begins"},
    {"roof:levels", TagValue::Count, "storeys in the roof"},
    {"roof:height", TagValue::LengthOrNone, "height of the roof"},
    {"roof:shape", TagValue::Word, "shape of the roof"},
    {"height", TagValue::Length, "height"},
});

/// Where a feature's tags put it. One answer for all layers, by the meanings that OpenStreetMap's wiki defines:
/// - indoor, highway = corridor, location = indoor: indoors;
/// - location = underground, tunnel: below ground; location = underwater: below water;
/// - level below 0 (all of several): below ground, unless a building states a height above the ground, being more
///   than that storey;
/// - parking = underground, and building:levels = 0 with building:levels:underground: a building, thing or area
///   without any height above the ground is below it. Storeys below the ground alone say nothing of those above;
/// - covered, and a tunnel that is a passage or a roof: covered; a building has a roof, or stands under another's, and
///   is open;
/// - layer is an order of what crosses, and puts nothing below ground alone. What is covered and has a layer below 0
///   is buried, buildings too.
Sight sight_of(const FeatureTags& tags, SightOf what);

/// Counts of what is left out because it cannot be seen.
class HiddenCounts {
 public:
  /// Whether a thing is hidden, which is then counted.
  bool is_hidden(const FeatureTags& tags, SightOf what);
  void add(Sight sight) { ++nums_[static_cast<std::size_t>(sight)]; }
  /// For LayerInfo::counts: those that are not 0.
  void append_to(std::vector<std::pair<std::string, std::int64_t>>& counts) const;
  bool operator==(const HiddenCounts&) const = default;

 private:
  std::array<std::int64_t, kNumSights> nums_ = {};
};

}  // namespace terracast::tiler
