#include "tiler/roads/road_features.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "tiler/roads/road_tags.h"
#include "tiler/sound_areas.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// Streets are in a town where so many ways end within some hundred metres.
constexpr double kTownCell_m = 100.0;
constexpr int kTownEnds = 10;
constexpr std::size_t kMostRingPoints = 20000;
constexpr double kLeastArea_m2 = 0.5;

/// Rings of finite places, each of three and more; none where the first is not one.
std::vector<PointsWorld> clean_rings(const std::vector<PointsWorld>& part, double half_m) {
  std::vector<PointsWorld> rings;
  for (const PointsWorld& ring : part) {
    PointsWorld kept;
    for (const Vector2d& at : ring)
      if (at.allFinite() && at.cwiseAbs().maxCoeff() < 4.0 * half_m + 1e4 &&
          (kept.empty() || (at - kept.back()).norm() > 0.01))
        kept.push_back(at);
    while (kept.size() > 1 && (kept.front() - kept.back()).norm() <= 0.01) kept.pop_back();
    kept = without_crowded_corners(std::move(kept));
    if (kept.size() > kMostRingPoints) {
      PointsWorld thinned;
      const std::size_t each = kept.size() / kMostRingPoints + 1;
      for (std::size_t i = 0; i < kept.size(); i += each) thinned.push_back(kept[i]);
      kept = std::move(thinned);
    }
    const bool is_ring = kept.size() >= 3 && enclosed_m2({kept}) > kLeastArea_m2;
    if (!is_ring && rings.empty()) return {};
    if (is_ring) rings.push_back(std::move(kept));
  }
  return rings;
}

}  // namespace

bool is_of_roads(const FeatureTags& all_tags) {
  const RoadTags tags(all_tags);
  if (tags.has("highway") || tags.has("railway") || tags.has("aeroway") || tags.has("area:highway"))
    return true;
  if (tags.value("amenity") == "parking" || tags.value("place") == "square") return true;
  const std::string_view man_made = tags.value("man_made");
  return man_made == "pier" || man_made == "breakwater" || man_made == "quay";
}

RoadFeatures sort_features(const std::vector<VectorFeature>& features, const RoadsOptions& options,
                           double half_size_m) {
  RoadFeatures sorted;
  for (const VectorFeature& feature : features) {
    const RoadTags tags(feature.tags);
    if (feature.kind == FeatureKind::Point) {
      if (tags.value("highway") != "crossing") continue;
      const std::string_view kind = tags.value("crossing");
      if (kind == "unmarked" || flag_from_tag(kind) == false) continue;
      if (sorted.hidden.is_hidden(feature.tags, SightOf::Area)) continue;
      for (const auto& part : feature.parts_world)
        for (const PointsWorld& line : part)
          for (const Vector2d& at : line)
            if (at.allFinite() && at.cwiseAbs().maxCoeff() < half_size_m)
              sorted.crossings.push_back({feature.number, at});
      continue;
    }
    if (feature.kind == FeatureKind::Line) {
      const auto style = way_style(feature.tags, sorted.num_repaired);
      if (!style) {
        ++sorted.num_not_built;
        continue;
      }
      for (const auto& part : feature.parts_world)
        for (const PointsWorld& line : part) {
          Way way{.feature = feature.number,
                  .style = *style,
                  .ref = std::string(tags.value("ref")),
                  .points_world = line};
          if (!options.has_bridges) way.style.is_bridge = false;
          if (style->semantic_class == core::SemanticClass::Pier)
            sorted.piers.push_back(std::move(way));
          else if (way.style.is_shaped || way.style.is_bridge)
            sorted.ways.push_back(std::move(way));
          else if (options.has_paths)
            sorted.paths.push_back(std::move(way));
        }
      continue;
    }
    const bool is_airfield = tags.value("aeroway") == "aerodrome";
    const auto style = pad_style(feature.tags);
    if (!style && !is_airfield) {
      ++sorted.num_not_built;
      continue;
    }
    if (!is_airfield && sorted.hidden.is_hidden(feature.tags, SightOf::Area)) continue;
    for (const auto& part : feature.parts_world) {
      std::vector<PointsWorld> rings = clean_rings(part, half_size_m);
      if (rings.empty()) {
        ++sorted.num_bad_areas;
        continue;
      }
      if (is_airfield)
        sorted.airfields.push_back(std::move(rings));
      else
        sorted.areas.push_back({feature.number, *style, std::move(rings)});
    }
  }
  return sorted;
}

void add_sidewalks(std::vector<Way>& ways) {
  std::unordered_map<std::int64_t, int> ends;
  const auto key = [](const Vector2d& at, int di, int dj) {
    return (static_cast<std::int64_t>(std::floor(at.x() / kTownCell_m)) + di) * 0x100000000LL +
           static_cast<std::int64_t>(std::floor(at.y() / kTownCell_m)) + dj;
  };
  const auto is_street = [](const WayStyle& style) {
    return style.use == WayUse::Road && style.rank >= 32 && style.rank <= 70 && style.rank != 35 &&
           style.rank != 45 && style.rank != 55 && style.rank != 65;
  };
  for (const Way& way : ways)
    if (way.style.use == WayUse::Road && !way.points_world.empty() &&
        way.points_world.front().allFinite() && way.points_world.back().allFinite())
      for (const Vector2d& at : {way.points_world.front(), way.points_world.back()})
        ++ends[key(at, 0, 0)];
  for (Way& way : ways) {
    if (!is_street(way.style) || way.style.sidewalk_m > 0.0 || way.points_world.empty()) continue;
    const Vector2d& middle = way.points_world[way.points_world.size() / 2];
    if (!middle.allFinite()) continue;
    int num = 0;
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const auto found = ends.find(key(middle, i, j));
        num += found == ends.end() ? 0 : found->second;
      }
    if (num < kTownEnds) continue;
    way.style.sidewalk_m = 1.8;
    way.style.shoulder_m = std::max(way.style.shoulder_m, 2.2);
  }
}

}  // namespace terracast::tiler
