#include "tiler/country/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace terracast::tiler::country {

std::string text_of(double value) { return fmt::format("{:g}", std::round(value * 100.0) / 100.0); }

void Survey::add(Theme theme, OsmKind osm_kind, FeatureKind kind, std::vector<PointsWorld> part,
                 Tags tags) {
  VectorFeature feature;
  feature.number = osm_number(
      osm_kind, static_cast<std::uint64_t>(theme) << 32 | ++counts_[static_cast<int>(theme)]);
  feature.kind = kind;
  feature.tags = FeatureTags(std::move(tags));
  for (PointsWorld& points : part) {
    PointsWorld kept;
    for (const Point& point : points)
      if (const Point at = snapped(point); kept.empty() || kept.back() != at) kept.push_back(at);
    if (kind == FeatureKind::Area)
      while (kept.size() > 1 && kept.front() == kept.back()) kept.pop_back();
    points = std::move(kept);
  }
  feature.parts_world.push_back(std::move(part));
  features_.push_back(std::move(feature));
}

void Survey::add_point(Theme theme, const Point& at, Tags tags) {
  add(theme, OsmKind::Node, FeatureKind::Point, {{at}}, std::move(tags));
}

void Survey::add_line(Theme theme, const PointsWorld& line, Tags tags) {
  if (line.size() < 2 || length_of(line) < 4.0 * kPlanStep_m) return;
  add(theme, OsmKind::Way, FeatureKind::Line, {line}, std::move(tags));
}

void Survey::add_area(Theme theme, std::vector<PointsWorld> rings, Tags tags) {
  if (rings.empty() || rings.front().size() < 3) return;
  const OsmKind kind = rings.size() == 1 ? OsmKind::Way : OsmKind::Relation;
  if (kind == OsmKind::Relation) tags.emplace_back("type", "multipolygon");
  add(theme, kind, FeatureKind::Area, std::move(rings), std::move(tags));
}

std::vector<VectorFeature> Survey::take() {
  std::sort(features_.begin(), features_.end(),
            [](const auto& a, const auto& b) { return a.number < b.number; });
  return std::move(features_);
}

}  // namespace terracast::tiler::country
