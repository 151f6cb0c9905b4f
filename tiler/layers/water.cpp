#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "geo/geoid.h"
#include "tiler/feature_source.h"
#include "tiler/layer.h"
#include "tiler/surface.h"
#include "tiler/water/water_features.h"
#include "tiler/water/water_map.h"
#include "tiler/water/water_profile.h"
#include "tiler/water/water_tags.h"
#include "tiler/world_options.h"

// Lakes, rivers and streams. Levels are found once, over the whole world: of each lake one, of the network of
// lines one that falls. The ground is then cut to them: it is the water's surface inside, and comes down to it
// beside. Streams too narrow for the terrain are painted on it.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::Cover;

/// Bumped when the same features give other water.
constexpr int kVersion = 5;

/// So many places of a lake are asked for its level at most, and of its shore.
constexpr int kLakePlaces = 24;  // along a side
constexpr std::size_t kShorePlaces = 160;
/// Shores lie at a lake's level, or above it where heights err: this part of them may lie below.
constexpr double kShoreQuantile = 0.25;
/// Ground beside water meets it with no more than this slope, unless it is too near or too far below.
constexpr double kLakeBank = 0.25;
constexpr double kRiverBank = 0.5;
constexpr double kLeastBank_m = 2.0;
/// A river whose level is farther from the ground's cannot have such banks: it runs below ground there, as where
/// its line leads over a ridge.
constexpr double kFarthestLevel_m = 0.5 * kRiverBank * WaterMap::kReach_m;
/// Streams that are painted cut in so deep.
constexpr double kStreamCut_m = 0.4;
/// Rivers are painted on tiles whose samples are too far apart for them.
constexpr double kSamplesAcross = 1.5;
/// Levels on whose tiles streams are too thin to be seen.
constexpr int kCoarsestPaintLevel = 6;
constexpr std::int16_t kPaintOrder = -100;
constexpr std::size_t kPointsOfStrip = 48;

/// A line that is painted, or part of it.
struct PaintedLine {
  world::Strip strip;
  double width_m = 0.0;
  bool is_carved = false;
  Vector2d low;
  Vector2d high;
};

double ramp_down(double share) {
  const double left = std::clamp(1.0 - share, 0.0, 1.0);
  return left * left;
}

class WaterLayer final : public Layer {
 public:
  WaterLayer(const FeatureSourceOptions& source, double narrowest_m, const LayerInputs& inputs)
      : frame_(inputs.frame),
        surface_(inputs.surface),
        narrowest_m_(narrowest_m),
        half_size_m_(0.5 * inputs.size_m) {
    for (const auto& layer : inputs.earlier) earlier_.push_back(layer.get());
    const std::string& datum = inputs.surface.options().elevation.front().vertical_datum;
    if (datum == "egm96") geoid_ = geo::Geoid::egm96();
    if (datum == "egm2008") geoid_ = geo::Geoid::egm2008();

    VectorOptions wanted;
    wanted.points = false;
    wanted.wanted = is_water_feature;
    const FeatureSet set = read_features(source, wanted, inputs, water_tag_table());
    WaterFeatures features = water_of(set.features, half_size_m_);
    info_.source = set.name;
    info_.counts = set.counts;
    info_.ledger = set.ledger;
    info_.counts.insert(info_.counts.end(), features.counts.begin(), features.counts.end());
    hash_ = core::content_hash(fmt::format("water {} {} {} {}", kVersion, set.content_hash,
                                           narrowest_m_, inputs.surface.input_hash()));
    info_.content_hash = hash_;
    std::vector<WaterArea> areas = measured_areas(features.polygons);
    make_rivers(features.lines, std::move(areas));
    for (const auto& [name, count] : info_.counts)
      if (name == "lines that run the other way" && count > 0)
        inputs.context.log.info(
            "{}: {} lines of water run the other way by the ground; they are "
            "turned",
            info_.source, count);
  }

  world::LayerInfo info() const override { return info_; }
  std::string input_hash() const override { return hash_; }

  double lift_m(const Vector2d& place_world, const SurfaceSample& ground) const override {
    std::vector<WaterMap::Near> near;
    map_.find(place_world, near);
    const double cut_m =
        near.empty() || near.front().distance_m > 0.0 ? stream_cut(place_world) : 0;
    if (near.empty()) return -cut_m;
    double earlier_m = 0.0;
    bool is_earlier_lake = false;
    for (const Layer* layer : earlier_) {
      earlier_m += layer->lift_m(place_world, ground);
      const auto cover = layer->cover(place_world, ground);
      is_earlier_lake = is_earlier_lake || (cover && *cover == Cover::Lake);
    }
    const double ground_m =
        frame_.geodetic_from_world({place_world.x(), place_world.y(), ground.z_world + earlier_m})
            .height_m;
    double sum_m = 0.0;
    double weights = 0.0;
    for (const WaterMap::Near& water : near) {
      const double rise_m = water.level_m - ground_m;
      if (water.distance_m <= 0.0) return rise_m;
      // A raster's lake goes on over the shore by part of its pixel.
      if (is_earlier_lake && water.cover == Cover::Lake) return rise_m;
      const double slope = water.cover == Cover::Lake ? kLakeBank : kRiverBank;
      const double bank_m =
          std::clamp(2.0 * std::abs(rise_m) / slope, kLeastBank_m, WaterMap::kReach_m);
      const double share = ramp_down(water.distance_m / bank_m);
      const double weight = share / (1.0 + 1e-6 - share);
      sum_m += weight * share * rise_m;
      weights += weight;
    }
    return (weights > 0.0 ? sum_m / weights : 0.0) - cut_m;
  }

  std::optional<Cover> cover(const Vector2d& place_world, const SurfaceSample&) const override {
    const auto water = water_at(place_world);
    return water ? std::optional(water->cover) : std::nullopt;
  }

  std::optional<double> water_depth_m(const Vector2d& place_world,
                                      const SurfaceSample&) const override {
    const auto water = water_at(place_world);
    if (!water) return std::nullopt;
    const double from_shore_m = -water->distance_m;
    const double slope_m = water->half_width_m > 0.0
                               ? water->half_width_m
                               : std::clamp(water->deepest_m / 0.12, 4.0, WaterMap::kReach_m);
    const double left = 1.0 - std::min(from_shore_m / slope_m, 1.0);
    return water->deepest_m * (1.0 - left * left) + 0.02;
  }

  bool holds(const Vector2d& place_world, double radius_m) const override {
    return map_.touches(place_world, radius_m) || streams_.touches(place_world, radius_m);
  }

  /// Banks are steps where one water ends and another's level begins, as where a river goes below ground.
  bool has_walls_near(const Vector2d& place_world, double within_m) const override {
    return map_.touches(place_world, within_m + WaterMap::kReach_m);
  }

  void add_objects(const world::TileId& id, const LayerSite&,
                   world::TileObjects& objects) const override {
    if (id.level > kCoarsestPaintLevel) return;
    const Vector2d low = id.corner_world();
    const Vector2d high = low.array() + id.side_m();
    for (const PaintedLine& line : painted_) {
      if ((line.high.array() < low.array()).any() || (line.low.array() > high.array()).any())
        continue;
      if (line.is_carved && id.spacing_m() * kSamplesAcross < line.width_m) continue;
      objects.strips.push_back(line.strip);
    }
  }

 private:
  double undulation_m(double lat_deg, double lon_deg) const {
    return geoid_ == nullptr ? 0.0 : geoid_->undulation_m(lat_deg, lon_deg);
  }

  struct GroundThere {
    double height_m;  ///< above the geoid
    double undulation_m;
    bool is_sea;
  };
  GroundThere ground_at(const Vector2d& place) const {
    const SurfaceSample sample = surface_.sample(place.x(), place.y());
    double lift_m = 0.0;
    if (sample.cover == Cover::Land)
      for (const Layer* layer : earlier_) lift_m += layer->lift_m(place, sample);
    const geo::Geodetic at =
        frame_.geodetic_from_world({place.x(), place.y(), sample.z_world + lift_m});
    const double undulation = undulation_m(at.lat_deg, at.lon_deg);
    return {at.height_m - undulation, undulation, sample.cover == Cover::Sea};
  }

  std::optional<WaterMap::Near> water_at(const Vector2d& place_world) const {
    std::vector<WaterMap::Near> near;
    map_.find(place_world, near);
    for (const WaterMap::Near& water : near)
      if (water.distance_m <= 0.0) return water;
    return std::nullopt;
  }

  double stream_cut(const Vector2d& place_world) const {
    std::vector<WaterMap::Near> near;
    streams_.find(place_world, near);
    double cut_m = 0.0;
    for (const WaterMap::Near& stream : near)
      cut_m = std::max(cut_m, kStreamCut_m * ramp_down(std::max(stream.distance_m, 0.0) / 1.5));
    return cut_m;
  }

  /// Areas with their levels: a lake lies where its ground has its middle height, but not above its shores.
  std::vector<WaterArea> measured_areas(const std::vector<WaterPolygon>& polygons) {
    std::vector<WaterArea> areas(polygons.size());
    std::vector<std::uint8_t> is_dropped(polygons.size(), 0);
    core::parallel_for(static_cast<std::int64_t>(polygons.size()), [&](std::int64_t row) {
      const auto k = static_cast<std::size_t>(row);
      const WaterPolygon& polygon = polygons[k];
      WaterArea& area = areas[k];
      area.number = polygon.number;
      area.rings_world = polygon.rings_world;
      area.is_river = polygon.is_river;
      area.deepest_m = polygon.is_river
                           ? std::clamp(0.25 * std::pow(polygon.mean_width_m, 0.75), 0.4, 12.0)
                           : std::clamp(0.02 * std::sqrt(polygon.area_m2), 0.6, 12.0);
      is_dropped[k] = find_level(area) ? 0 : 1;
    });
    std::vector<WaterArea> kept;
    std::int64_t num_at_sea = 0;
    for (std::size_t k = 0; k < areas.size(); ++k) {
      if (is_dropped[k] != 0)
        ++num_at_sea;
      else
        kept.push_back(std::move(areas[k]));
    }
    info_.counts.emplace_back("areas outside the square or at sea", num_at_sea);
    return kept;
  }

  bool find_level(WaterArea& area) const {
    Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
    Vector2d high = -low;
    std::size_t num_points = 0;
    for (const auto& ring : area.rings_world) {
      num_points += ring.size();
      for (const Vector2d& point : ring) {
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
      }
    }
    if ((low.array() > half_size_m_).any() || (high.array() < -half_size_m_).any()) return false;
    const auto is_in_square = [&](const Vector2d& place) {
      return place.cwiseAbs().maxCoeff() <= half_size_m_;
    };
    std::vector<double> shore_m;
    double undulation = 0.0;
    Vector2d middle = Vector2d::Zero();
    std::size_t num_sea = 0;
    std::size_t at = 0;
    const std::size_t every = std::max<std::size_t>(1, num_points / kShorePlaces);
    for (const auto& ring : area.rings_world)
      for (const Vector2d& point : ring) {
        if (at++ % every != 0 || !is_in_square(point)) continue;
        const GroundThere ground = ground_at(point);
        if (ground.is_sea) {
          ++num_sea;
          continue;
        }
        shore_m.push_back(ground.height_m);
        middle += point;
        undulation += ground.undulation_m;
      }
    if (shore_m.empty() || num_sea > shore_m.size()) return false;
    middle /= static_cast<double>(shore_m.size());
    undulation /= static_cast<double>(shore_m.size());
    const auto quantile = [](std::vector<double>& values, double share) {
      const auto place = values.begin() + static_cast<std::ptrdiff_t>(
                                              share * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), place, values.end());
      return *place;
    };
    double level_m = quantile(shore_m, kShoreQuantile);
    // The ground inside, where the area is wide enough to have some.
    const WaterMap alone({area}, {}, half_size_m_);
    std::vector<double> inside_m;
    std::vector<WaterMap::Near> near;
    for (int j = 0; j < kLakePlaces; ++j)
      for (int i = 0; i < kLakePlaces; ++i) {
        const Vector2d place =
            low + (high - low).cwiseProduct(Vector2d(i + 0.5, j + 0.5) / kLakePlaces);
        if (!is_in_square(place)) continue;
        alone.find(place, near);
        if (near.empty() || near.front().distance_m > 0.0) continue;
        const GroundThere ground = ground_at(place);
        if (!ground.is_sea) inside_m.push_back(ground.height_m);
      }
    if (!inside_m.empty()) level_m = std::min(level_m, quantile(inside_m, 0.5));
    area.level_m = level_m + undulation;
    area.middle_world = middle;
    if (geoid_ != nullptr) {
      // How the geoid leans: by 1e-4 at most, 1 m over a lake of 10 km.
      const auto there_m = [&](const Vector2d& place) {
        const geo::Geodetic found = frame_.geodetic_from_world({place.x(), place.y(), 0.0});
        return undulation_m(found.lat_deg, found.lon_deg);
      };
      constexpr double kWay_m = 2000.0;
      for (int axis = 0; axis < 2; ++axis) {
        const Vector2d way = kWay_m * Vector2d::Unit(axis);
        area.slope[axis] = (there_m(middle + way) - there_m(middle - way)) / (2.0 * kWay_m);
      }
    }
    return true;
  }

  void make_rivers(const std::vector<WaterLineInfo>& infos, std::vector<WaterArea> areas) {
    // Lakes alone first: lines take their levels.
    const WaterMap lakes(areas, {}, half_size_m_);
    std::vector<Waterline> lines;
    lines.reserve(infos.size());
    for (const WaterLineInfo& info : infos) lines.push_back(info.line);
    const WaterCourses fitted = fit_courses(lines, [&](const Vector2d& place) {
      const GroundThere ground = ground_at(place);
      CourseGround found{.height_m = ground.height_m};
      if (ground.is_sea) found.level_m = ground.height_m;
      std::vector<WaterMap::Near> near;
      lakes.find(place, near);
      for (const WaterMap::Near& water : near)
        if (water.distance_m <= 0.0 && water.cover == Cover::Lake)
          found.level_m = water.level_m - ground.undulation_m;
      return found;
    });
    info_.counts.emplace_back("lines that run the other way", fitted.num_reversed);
    info_.counts.emplace_back("places where levels of lines and lakes do not fit",
                              fitted.num_conflicts);

    std::vector<RiverPiece> rivers;
    std::vector<RiverPiece> streams;
    std::int64_t num_streams = 0;
    std::int64_t num_far = 0;
    std::vector<std::vector<std::uint8_t>> shown(fitted.courses.size());
    core::parallel_for(static_cast<std::int64_t>(shown.size()), [&](std::int64_t k) {
      const WaterCourse& course = fitted.courses[static_cast<std::size_t>(k)];
      shown[static_cast<std::size_t>(k)] = shown_stretches(course, infos[course.line]);
    });
    for (std::size_t row = 0; row < fitted.courses.size(); ++row) {
      const WaterCourse& course = fitted.courses[row];
      const WaterLineInfo& info = infos[course.line];
      const std::vector<std::uint8_t>& is_shown = shown[row];
      const bool is_narrow = is_painted_alone(info);
      if (is_narrow) ++num_streams;
      if (!info.line.is_covered)
        num_far += std::count(is_shown.begin() + 1, is_shown.end(), std::uint8_t{0});
      std::vector<RiverPiece>& list = is_narrow ? streams : rivers;
      for (std::size_t i = 1; i < course.points_world.size(); ++i) {
        const auto level_m = [&](std::size_t k) {
          const Vector2d& place = course.points_world[k];
          const geo::Geodetic at = frame_.geodetic_from_world({place.x(), place.y(), 0.0});
          return course.levels_m[k] + undulation_m(at.lat_deg, at.lon_deg);
        };
        const bool is_in_lake = course.is_in_lake[i - 1] != 0 && course.is_in_lake[i] != 0;
        if (is_narrow && (is_in_lake || is_shown[i] == 0)) continue;
        list.push_back({.from_world = course.points_world[i - 1],
                        .to_world = course.points_world[i],
                        .from_level_m = level_m(i - 1),
                        .to_level_m = level_m(i),
                        .half_width_m = info.line.half_width_m,
                        .is_carved = !is_in_lake && is_shown[i] != 0});
      }
      paint(course, info, is_shown, !is_narrow);
    }
    info_.counts.emplace_back("stretches of rivers too far from the ground", num_far);
    info_.counts.emplace_back("stretches of painted streams", num_streams);
    map_ = WaterMap(std::move(areas), std::move(rivers), half_size_m_);
    streams_ = WaterMap({}, std::move(streams), half_size_m_);
  }

  /// Whether a line has no bed of its own.
  bool is_painted_alone(const WaterLineInfo& info) const {
    return 2.0 * info.line.half_width_m < narrowest_m_ || info.is_dry;
  }

  /// Of each stretch, called by its second point, whether it runs on the ground. What is painted alone needs no banks.
  std::vector<std::uint8_t> shown_stretches(const WaterCourse& course,
                                            const WaterLineInfo& info) const {
    std::vector<std::uint8_t> is_shown(course.points_world.size(), info.line.is_covered ? 0 : 1);
    if (info.line.is_covered || is_painted_alone(info)) return is_shown;
    std::vector<double> away_m(course.points_world.size(), 0.0);
    for (std::size_t i = 0; i < away_m.size(); ++i)
      if (course.is_in_lake[i] == 0)
        away_m[i] = std::abs(course.levels_m[i] - ground_at(course.points_world[i]).height_m);
    for (std::size_t i = 1; i < away_m.size(); ++i)
      is_shown[i] = std::max(away_m[i - 1], away_m[i]) <= kFarthestLevel_m ? 1 : 0;
    return is_shown;
  }

  /// is_on_ground   of shown_stretches()
  void paint(const WaterCourse& course, const WaterLineInfo& info,
             const std::vector<std::uint8_t>& is_on_ground, bool is_carved) {
    PaintedLine line;
    line.width_m = 2.0 * info.line.half_width_m;
    line.is_carved = is_carved;
    line.strip.coating = {
        .layer = 0,
        .feature = info.line.number,
        .order = kPaintOrder,
        .paving = info.is_dry ? world::Paving::Gravel : world::Paving::Water,
        .semantic_class = info.is_dry ? core::SemanticClass::Scree : core::SemanticClass::River};
    line.strip.half_width_steps =
        static_cast<std::int32_t>(std::lround(info.line.half_width_m / world::kHeightStep_m));
    const auto is_far = [&](const Vector2d& place) {
      return place.cwiseAbs().maxCoeff() > half_size_m_;
    };
    for (std::size_t i = 1; i < course.points_world.size(); ++i)
      line.strip.whole_m += (course.points_world[i] - course.points_world[i - 1]).norm();
    double way_m = 0.0;
    const auto finish = [&] {
      std::vector<Eigen::Vector2i>& points = line.strip.points_steps;
      if (points.size() > 1) painted_.push_back(line);
      points.clear();
    };
    for (std::size_t i = 1; i < course.points_world.size(); ++i) {
      const Vector2d& from = course.points_world[i - 1];
      const Vector2d& to = course.points_world[i];
      const bool is_shown = is_on_ground[i] != 0 &&
                            !(course.is_in_lake[i - 1] != 0 && course.is_in_lake[i] != 0) &&
                            !is_far(from) && !is_far(to);
      std::vector<Eigen::Vector2i>& points = line.strip.points_steps;
      if (!is_shown || points.size() >= kPointsOfStrip) finish();
      if (is_shown) {
        const auto steps = [](const Vector2d& place) {
          return Eigen::Vector2i((place / world::kHeightStep_m).array().round().cast<int>());
        };
        if (points.empty()) {
          points.push_back(steps(from));
          line.strip.start_m = way_m;
          line.low = from.array() - info.line.half_width_m;
          line.high = from.array() + info.line.half_width_m;
        }
        if (steps(to) != points.back()) points.push_back(steps(to));
        line.low = line.low.cwiseMin((to.array() - info.line.half_width_m).matrix());
        line.high = line.high.cwiseMax((to.array() + info.line.half_width_m).matrix());
      }
      way_m += (to - from).norm();
    }
    finish();
  }

  const geo::WorldFrame& frame_;
  const WorldSurface& surface_;
  double narrowest_m_;
  double half_size_m_;
  std::vector<const Layer*> earlier_;
  std::shared_ptr<const geo::Geoid> geoid_;
  WaterMap map_{{}, {}, 0.0};
  WaterMap streams_{{}, {}, 0.0};
  std::vector<PaintedLine> painted_;
  world::LayerInfo info_;
  std::string hash_;
};

class Water final : public LayerKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    source_.describe(visit);
    visit.key("narrowest_m", narrowest_m_,
              "Lines of water narrower than this, and those that are dry for most of the year, are "
              "painted on the ground; wider ones have a bed and a surface of their own.",
              core::between(0.5, 100.0));
  }
  void validate() const override { source_.validate(); }
  std::unique_ptr<LayerKind> clone() const override { return std::make_unique<Water>(*this); }
  std::unique_ptr<Layer> make(const LayerInputs& inputs) const override {
    return std::make_unique<WaterLayer>(source_, narrowest_m_, inputs);
  }

 private:
  FeatureSourceOptions source_;
  double narrowest_m_ = 3.0;
};

}  // namespace

LayerKindInfo water_layer() {
  return {"water", "Lakes, rivers and streams from features with OpenStreetMap's keys.",
          [] { return std::unique_ptr<LayerKind>(std::make_unique<Water>()); }};
}

}  // namespace terracast::tiler
