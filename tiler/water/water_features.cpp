#include "tiler/water/water_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "tiler/sound_areas.h"
#include "tiler/water/water_map.h"
#include "tiler/water/water_tags.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// What is farther beyond the square is not followed.
constexpr double kBeyond_m = 1000.0;
constexpr double kWidest_m = 20000.0;
constexpr double kLeastArea_m2 = 4.0;

struct LineKind {
  std::string_view waterway;
  int rank;
  double width_m;  ///< where no tag says it
};
constexpr std::array<LineKind, 9> kLineKinds = {{{"river", 3, 14.0},
                                                 {"canal", 2, 9.0},
                                                 {"tidal_channel", 2, 8.0},
                                                 {"flowline", 1, 2.0},
                                                 {"stream", 1, 1.8},
                                                 {"brook", 1, 1.6},
                                                 {"wadi", 1, 5.0},
                                                 {"drain", 0, 1.4},
                                                 {"ditch", 0, 1.0}}};

const LineKind* kind_of(const WaterTags& tags) {
  for (const LineKind& kind : kLineKinds)
    if (tags.value("waterway") == kind.waterway) return &kind;
  return nullptr;
}

bool is_area_tagged(const WaterTags& tags) {
  const std::string_view waterway = tags.value("waterway");
  const std::string_view landuse = tags.value("landuse");
  return tags.value("natural") == "water" || waterway == "riverbank" || waterway == "dock" ||
         landuse == "reservoir" || landuse == "basin";
}

bool is_river_area(const WaterTags& tags) {
  const std::string_view water = tags.value("water");
  return tags.value("waterway") == "riverbank" || water == "river" || water == "stream" ||
         water == "canal" || water == "oxbow_river";
}

/// Twice the signed area of a ring.
double twice_area(const PointsWorld& ring) {
  double sum = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d a = ring[i] - ring.front();
    const Vector2d b = ring[(i + 1) % ring.size()] - ring.front();
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum;
}

/// The stretches of a line that lie in the square or near it.
std::vector<PointsWorld> near_square(const PointsWorld& line, double border_m) {
  const auto is_near = [&](const Vector2d& a, const Vector2d& b) {
    return (a.cwiseMin(b).array() <= border_m).all() && (a.cwiseMax(b).array() >= -border_m).all();
  };
  std::vector<PointsWorld> stretches;
  bool goes_on = false;
  for (std::size_t i = 1; i < line.size(); ++i) {
    if (line[i] == line[i - 1]) continue;
    if (!is_near(line[i - 1], line[i])) {
      goes_on = false;
      continue;
    }
    if (!goes_on) stretches.push_back({line[i - 1]});
    stretches.back().push_back(line[i]);
    goes_on = true;
  }
  return stretches;
}

class Taker {
 public:
  explicit Taker(double half_size_m) : half_size_m_(half_size_m) {}

  void take(const VectorFeature& feature) {
    if (feature.kind == FeatureKind::Line)
      take_lines(feature);
    else if (feature.kind == FeatureKind::Area && is_area_tagged(feature.tags) &&
             !hidden_.is_hidden(feature.tags, SightOf::Area))
      take_areas(feature);
  }

  WaterFeatures finish() {
    found_.counts = {{"lines", num_lines_},
                     {"lines below ground", num_covered_},
                     {"areas", static_cast<std::int64_t>(found_.polygons.size())},
                     {"widths that are none", num_widths_},
                     {"areas that are none", num_flat_},
                     {"areas repaired", num_repaired_}};
    hidden_.append_to(found_.counts);
    return std::move(found_);
  }

 private:
  void take_lines(const VectorFeature& feature) {
    const WaterTags tags(feature.tags);
    const LineKind* kind = kind_of(tags);
    if (kind == nullptr) return;
    WaterLineInfo info;
    double width_m = kind->width_m;
    using Key = WaterTags::AmountKey;
    for (const Key& key : {Key("width"), Key("est_width")}) {
      const std::optional<double> told_m = tags.middle(key);
      if (!told_m) {
        if (feature.tags.has(key.rule().name)) ++num_widths_;
        continue;
      }
      if (*told_m > 0.05 && *told_m < kWidest_m) {
        width_m = *told_m;
        break;
      }
      ++num_widths_;
    }
    info.line.number = feature.number;
    info.line.rank = kind->rank;
    info.line.half_width_m = 0.5 * width_m;
    info.line.is_covered = sight_of(feature.tags, SightOf::Waterway) != Sight::Open;
    info.line.name = std::string(tags.value("name"));
    info.is_dry =
        kind->waterway == "wadi" || tags.is_yes("intermittent") || tags.is_yes("seasonal");
    bool is_any = false;
    for (const PointsWorld& part :
         feature.parts_world.empty() ? std::vector<PointsWorld>{} : lines_of(feature)) {
      for (PointsWorld& stretch : near_square(part, half_size_m_ + kBeyond_m)) {
        info.line.points_world = std::move(stretch);
        found_.lines.push_back(info);
        ++info.line.part;
        is_any = true;
      }
    }
    if (!is_any) return;
    ++num_lines_;
    if (info.line.is_covered) ++num_covered_;
  }

  static std::vector<PointsWorld> lines_of(const VectorFeature& feature) {
    std::vector<PointsWorld> lines;
    for (const auto& part : feature.parts_world)
      lines.insert(lines.end(), part.begin(), part.end());
    return lines;
  }

  void take_areas(const VectorFeature& feature) {
    for (const auto& part : feature.parts_world) {
      std::vector<PointsWorld> rings;
      for (const PointsWorld& ring : part)
        if (ring.size() >= 3) rings.push_back(without_crowded_corners(ring));
      using Polygons = std::vector<std::vector<PointsWorld>>;
      const std::optional<Polygons> polygons = repaired_area(rings);
      bool is_any = false;
      if (!polygons) is_any = take_polygon(feature, std::move(rings));
      if (polygons)
        for (const std::vector<PointsWorld>& polygon : *polygons)
          is_any = take_polygon(feature, polygon) || is_any;
      if (is_any && polygons) ++num_repaired_;
      if (!is_any) ++num_flat_;
    }
  }

  /// Whether it has an area.
  bool take_polygon(const VectorFeature& feature, std::vector<PointsWorld> rings) {
    WaterPolygon polygon;
    polygon.number = feature.number;
    polygon.is_river = is_river_area(feature.tags);
    double twice_m2 = 0.0;
    double shore_m = 0.0;
    for (std::size_t k = 0; k < rings.size(); ++k) {
      const PointsWorld& ring = rings[k];
      twice_m2 += (k == 0 ? 1.0 : -1.0) * std::abs(twice_area(ring));
      for (std::size_t i = 0; i < ring.size(); ++i)
        shore_m += (ring[(i + 1) % ring.size()] - ring[i]).norm();
    }
    polygon.rings_world = std::move(rings);
    polygon.area_m2 = 0.5 * twice_m2;
    if (polygon.rings_world.empty() || !(polygon.area_m2 >= kLeastArea_m2)) return false;
    polygon.mean_width_m = 2.0 * polygon.area_m2 / shore_m;
    found_.polygons.push_back(std::move(polygon));
    return true;
  }

  double half_size_m_;
  WaterFeatures found_;
  HiddenCounts hidden_;
  std::int64_t num_lines_ = 0;
  std::int64_t num_covered_ = 0;
  std::int64_t num_widths_ = 0;
  std::int64_t num_flat_ = 0;
  std::int64_t num_repaired_ = 0;
};

}  // namespace

bool is_water_feature(const FeatureTags& tags) {
  return kind_of(tags) != nullptr || is_area_tagged(tags);
}

WaterFeatures water_of(const std::vector<VectorFeature>& features, double half_size_m) {
  Taker taker(half_size_m);
  for (const VectorFeature& feature : features) taker.take(feature);
  return taker.finish();
}

}  // namespace terracast::tiler
