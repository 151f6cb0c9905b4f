#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>
#include <unordered_map>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tiler/dry_cover.h"
#include "tiler/feature_source.h"
#include "tiler/instance_ids.h"
#include "tiler/layer.h"
#include "tiler/layer_stack.h"
#include "tiler/roads/area_pier.h"
#include "tiler/roads/bridge_builder.h"
#include "tiler/roads/deep_cuttings.h"
#include "tiler/roads/pads.h"
#include "tiler/roads/road_bed.h"
#include "tiler/roads/road_heights.h"
#include "tiler/roads/road_network.h"
#include "tiler/roads/road_paint.h"
#include "tiler/roads/water_gaps.h"
#include "tiler/roads/way_parts.h"
#include "tiler/sound_areas.h"
#include "tiler/surface.h"

// Roads, paths, railways, airfields, places: a network with long profiles, earth works, paint and bridges.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::Cover;

/// Bumped when the same features make something else.
constexpr int kRoadsVersion = 8;
/// Streets are in a town where so many ways end within some hundred metres.
constexpr double kTownCell_m = 100.0;
constexpr int kTownEnds = 10;
constexpr double kPierAbove_m = 1.3;
constexpr double kPierBelow_m = 8.0;
constexpr std::size_t kMostRingPoints = 20000;
constexpr double kLeastArea_m2 = 0.5;

struct RoadsOptions {
  std::string sidewalks = "streets";
  bool has_paths = true;
  bool has_bridges = true;
};

/// What is painted and not shaped: where nothing may stand.
class HeldPlaces {
 public:
  void add_line(const Vector2d& a, const Vector2d& b, double half_m) {
    const auto number = static_cast<std::uint32_t>(lines_.size());
    lines_.push_back({a, b, half_m});
    put(a.cwiseMin(b).array() - half_m, a.cwiseMax(b).array() + half_m, number << 1);
  }
  void add_area(const std::vector<PointsWorld>& rings) {
    const auto number = static_cast<std::uint32_t>(areas_.size());
    areas_.push_back(rings);
    Vector2d low = rings.front().front();
    Vector2d high = low;
    for (const Vector2d& at : rings.front()) {
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    put(low, high, number << 1 | 1U);
  }
  bool holds(const Vector2d& at, double radius_m) const {
    for (std::int32_t j = cell(at.y() - radius_m); j <= cell(at.y() + radius_m); ++j)
      for (std::int32_t i = cell(at.x() - radius_m); i <= cell(at.x() + radius_m); ++i) {
        const auto found = cells_.find(key(i, j));
        if (found == cells_.end()) continue;
        for (const std::uint32_t entry : found->second) {
          if ((entry & 1U) != 0) {
            const RingSide side = side_of_rings(areas_[entry >> 1], at);
            if (side.is_inside || side.distance_m < radius_m) return true;
            continue;
          }
          const Segment& line = lines_[entry >> 1];
          const Vector2d step = line.b - line.a;
          const double t =
              std::clamp((at - line.a).dot(step) / std::max(step.squaredNorm(), 1e-9), 0.0, 1.0);
          if ((line.a + t * step - at).norm() < line.half_m + radius_m) return true;
        }
      }
    return false;
  }

 private:
  struct Segment {
    Vector2d a;
    Vector2d b;
    double half_m;
  };
  static std::int32_t cell(double at) { return static_cast<std::int32_t>(std::floor(at / 16.0)); }
  static std::uint64_t key(std::int32_t i, std::int32_t j) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32 |
           static_cast<std::uint32_t>(j);
  }
  void put(const Vector2d& low, const Vector2d& high, std::uint32_t entry) {
    for (std::int32_t j = cell(low.y()); j <= cell(high.y()); ++j)
      for (std::int32_t i = cell(low.x()); i <= cell(high.x()); ++i)
        cells_[key(i, j)].push_back(entry);
  }

  std::vector<Segment> lines_;
  std::vector<std::vector<PointsWorld>> areas_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

/// What a source's features are for this layer.
struct Sorted {
  std::vector<Way> ways;   ///< shaped, or bridges
  std::vector<Way> paths;  ///< only painted
  std::vector<Way> piers;
  std::vector<PaintedArea> areas;
  std::vector<std::vector<PointsWorld>> airfields;  ///< whose ground is kept as grass
  std::vector<FootCrossing> crossings;
  std::int64_t num_repaired = 0;
  std::int64_t num_bad_areas = 0;
};

bool is_wanted(const FeatureTags& tags) {
  if (tags.has("highway") || tags.has("railway") || tags.has("aeroway") || tags.has("area:highway"))
    return true;
  if (tags.value("amenity") == "parking" || tags.value("place") == "square") return true;
  const std::string_view man_made = tags.value("man_made");
  return man_made == "pier" || man_made == "breakwater" || man_made == "quay";
}

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

Sorted sort_features(const std::vector<VectorFeature>& features, const RoadsOptions& options,
                     double half_size_m) {
  Sorted sorted;
  for (const VectorFeature& feature : features) {
    if (feature.kind == FeatureKind::Point) {
      if (feature.tags.value("highway") != "crossing") continue;
      const std::string_view kind = feature.tags.value("crossing");
      if (kind == "unmarked" || kind == "no") continue;
      for (const auto& part : feature.parts_world)
        for (const PointsWorld& line : part)
          for (const Vector2d& at : line)
            if (at.allFinite() && at.cwiseAbs().maxCoeff() < half_size_m)
              sorted.crossings.push_back({feature.number, at});
      continue;
    }
    if (feature.kind == FeatureKind::Line) {
      const auto style = way_style(feature.tags, sorted.num_repaired);
      if (!style) continue;
      for (const auto& part : feature.parts_world)
        for (const PointsWorld& line : part) {
          Way way{.feature = feature.number,
                  .style = *style,
                  .ref = std::string(feature.tags.value("ref")),
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
    const bool is_airfield = feature.tags.value("aeroway") == "aerodrome";
    const auto style = pad_style(feature.tags);
    if (!style && !is_airfield) continue;
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

/// Streets between houses get sidewalks where many ways end.
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

class RoadsLayer final : public Layer, public DryCover {
 public:
  RoadsLayer(const FeatureSourceOptions& source, const RoadsOptions& options,
             const LayerInputs& inputs)
      : surface_(inputs.surface), half_size_m_(0.5 * inputs.size_m) {
    for (const auto& layer : inputs.earlier) earlier_.push_back(layer.get());
    FeatureSet set = read_features(
        source, {.points = true, .lines = true, .areas = true, .wanted = is_wanted}, inputs);
    hash_ = core::content_hash(fmt::format("roads {} {} {} {} {} {}", kRoadsVersion, inputs.seed,
                                           set.content_hash, options.sidewalks, options.has_paths,
                                           options.has_bridges));
    info_.source = set.name;
    info_.content_hash = set.content_hash;
    info_.counts = set.counts;

    const double half_size_m = half_size_m_;
    Sorted sorted = sort_features(set.features, options, half_size_m);
    set.features.clear();
    if (options.sidewalks == "streets") add_sidewalks(sorted.ways);
    if (options.sidewalks == "none")
      for (Way& way : sorted.ways) way.style.sidewalk_m = 0.0;
    const auto num_ways = static_cast<std::int64_t>(sorted.ways.size());
    const auto num_paths = static_cast<std::int64_t>(sorted.paths.size());

    const RoadGroundFunction ground = [this](const Vector2d& at) { return ground_at(at); };
    const IsWater is_water = [this](const Vector2d& at) { return ground_at(at).is_water; };
    RoadNetwork network(std::move(sorted.ways), half_size_m);
    const RoadNetwork paths(std::move(sorted.paths), half_size_m);
    RoadHeights heights(network, ground);
    const std::vector<Stretch> tunnels = deep_cuttings(network, heights);
    if (!tunnels.empty()) {
      network.run_below_ground(tunnels);
      heights = RoadHeights(network, ground);
    }
    const IsWater is_sea = [this](const Vector2d& at) {
      return surface_.sample(at.x(), at.y()).cover == Cover::Sea;
    };
    const auto gaps = water_gaps(network, is_water, is_sea);
    const auto path_gaps = water_gaps(paths, is_water, is_sea);
    Pads pads = make_pads(sorted.areas, network, heights, ground);
    const auto num_pads = static_cast<std::int64_t>(pads.pads.size());
    bed_.emplace(network, heights, ground, gaps, std::move(pads.pads));

    paint_.add_network(network, gaps);
    paint_.add_network(paths, path_gaps);
    WayParts parts;
    parts.add(network, &heights, gaps);
    parts.add(paths, nullptr, path_gaps);
    ways_ = parts.take();
    std::int64_t num_area_piers = 0;
    std::int64_t num_bad_piers = 0;
    const std::vector<PaintedArea> on_land =
        add_area_piers(sorted.areas, inputs, num_area_piers, num_bad_piers);
    paint_.add_areas(on_land, is_water);
    paint_.add_crossings(network, sorted.crossings, inputs.seed);

    std::vector<Deck> decks = bridge_decks(network, heights);
    lower_at_border(decks, half_size_m);
    const auto num_bridges = static_cast<std::int64_t>(decks.size());
    const std::int64_t num_piers = add_piers(sorted.piers, half_size_m, decks);
    build_decks(decks, inputs);
    paint_.index();
    hold(paths, on_land);
    for (const std::vector<PointsWorld>& rings : sorted.airfields) airfields_.add_area(rings);

    std::int64_t num_gaps = 0;
    for (const auto* all : {&gaps, &path_gaps})
      for (const auto& of_line : *all) num_gaps += static_cast<std::int64_t>(of_line.size());
    const NetworkCounts& counts = network.counts();
    const NetworkCounts& more = paths.counts();
    const auto put = [&](const std::string& name, std::int64_t count) {
      info_.counts.emplace_back(name, count);
    };
    put("roads, railways and runways", num_ways);
    put("paths", num_paths);
    put("areas", static_cast<std::int64_t>(sorted.areas.size()));
    put("airfields", static_cast<std::int64_t>(sorted.airfields.size()));
    put("areas made even", num_pads);
    put("areas too steep to be made even", pads.num_too_steep);
    put("areas that are none", sorted.num_bad_areas);
    put("bridges", num_bridges);
    put("piers", num_piers + num_area_piers);
    put("areas of piers that cross themselves", num_bad_piers);
    put("crossings of bridges", static_cast<std::int64_t>(heights.crossings().size()));
    put("crossings of bridges with less room than stated",
        tell_low_crossings(network, heights, inputs.context.log));
    put("zebra crossings", paint_.num_crossings());
    put("parts of ways in cuttings so deep that they run below ground",
        static_cast<std::int64_t>(tunnels.size()));
    put("parts of ways left out in water", num_gaps);
    put("ways without length", counts.num_without_length + more.num_without_length);
    put("points that are no places", counts.num_not_finite + more.num_not_finite);
    put("ways that are there twice", counts.num_duplicates + more.num_duplicates);
    put("ways thinned", counts.num_thinned + more.num_thinned);
    put("ways cut at the square", counts.num_outside + more.num_outside);
    put("widths and lanes repaired", sorted.num_repaired);
  }

  world::LayerInfo info() const override { return info_; }
  std::string input_hash() const override { return hash_; }
  world::WayNetwork ways() const override { return ways_; }

  double lift_m(const Vector2d& place_world, const SurfaceSample& ground) const override {
    if (!bed_->is_near(place_world)) return 0.0;
    double z = ground.z_world;
    for (const Layer* layer : earlier_) z += layer->lift_m(place_world, ground);
    const double before_m = level_of(place_world, z);
    const RoadBed::Shaped shaped = bed_->shaped(place_world, before_m);
    if (shaped.level_m == before_m) return 0.0;
    if (!shaped.is_way && is_water(earlier_cover(place_world, ground))) return 0.0;
    return shaped.level_m - before_m;
  }

  /// Nobody sows or plants between runways.
  std::optional<Cover> cover(const Vector2d& place_world, const SurfaceSample&) const override {
    return airfields_.holds(place_world, 0.0) ? std::optional(Cover::Grass) : std::nullopt;
  }

  bool holds(const Vector2d& place_world, double radius_m) const override {
    return bed_->holds(place_world, radius_m) || held_.holds(place_world, radius_m);
  }

  bool has_walls_near(const Vector2d& place_world, double within_m) const override {
    return bed_->is_near(place_world, within_m);
  }

  void add_objects(const world::TileId& id, const LayerSite&,
                   world::TileObjects& objects) const override {
    paint_.add_to(id, objects);
    const Vector2d low = id.corner_world();
    const Vector2d high = low.array() + id.side_m();
    for (const Built& built : built_)
      if ((built.lowest.array() <= high.array()).all() &&
          (built.highest.array() >= low.array()).all())
        objects.solids.push_back(built.solid);
  }

 private:
  struct Built {
    world::Solid solid;
    Vector2d lowest;
    Vector2d highest;
  };

  static bool is_water(Cover cover) {
    return cover == Cover::Sea || cover == Cover::Lake || cover == Cover::River;
  }
  Cover earlier_cover(const Vector2d& place_world, const SurfaceSample& sample) const {
    std::optional<Cover> known;  // the first that knows of water is believed, then the first
    for (const Layer* layer : earlier_) {
      const auto cover = layer->cover(place_world, sample);
      if (cover && is_water(*cover)) return *cover;
      if (!known) known = cover;
    }
    return known.value_or(sample.cover);
  }
  RoadGround ground_at(const Vector2d& place_world) const {
    const SurfaceSample sample = surface_.sample(place_world.x(), place_world.y());
    if (sample.cover == Cover::Sea) return {level_of(place_world, sample.z_world), true};
    double z = sample.z_world;
    for (const Layer* layer : earlier_) z += layer->lift_m(place_world, sample);
    return {level_of(place_world, z), is_water(earlier_cover(place_world, sample))};
  }
  /// With the earth works.
  double finished_level_m(const Vector2d& place_world) const {
    const RoadGround ground = ground_at(place_world);
    if (ground.is_water) return ground.level_m;
    const double bare_m =
        level_of(place_world, surface_.sample(place_world.x(), place_world.y()).z_world);
    return bare_m + lift_share(place_world, half_size_m_) *
                        (bed_->shaped(place_world, ground.level_m).level_m - bare_m);
  }

  /// Their number; each is told with its place.
  static std::int64_t tell_low_crossings(const RoadNetwork& network, const RoadHeights& heights,
                                         const core::Log& log) {
    std::int64_t num = 0;
    for (const BridgeCrossing& crossing : heights.crossings()) {
      if (!crossing.is_low()) continue;
      ++num;
      const Line& above = network.lines()[crossing.line_above];
      log.debug(
          "bridge of feature {} at {:.0f} E {:.0f} N has {:.2f} m of {:.2f} m to what it crosses",
          network.ways()[above.spans[crossing.span_above].way].feature, crossing.at_world.x(),
          crossing.at_world.y(), crossing.room_m, crossing.wanted_m);
    }
    return num;
  }

  /// Where the square ends its ground is as it was before all layers, and decks with it; over water they stay above.
  void lower_at_border(std::vector<Deck>& decks, double half_size_m) const {
    for (Deck& deck : decks)
      for (DeckPoint& point : deck.points) {
        const double share = lift_share(point.at_world, half_size_m);
        if (share >= 1.0) continue;
        const SurfaceSample bare = surface_.sample(point.at_world.x(), point.at_world.y());
        const double ground_m = level_of(point.at_world, bare.z_world);
        const double lowered_m = ground_m + share * (point.level_m - ground_m);
        point.level_m = ground_at(point.at_world).is_water
                            ? std::max(lowered_m, std::min(point.level_m, ground_m + kPierAbove_m +
                                                                              deck.thickness_m))
                            : lowered_m;
      }
  }

  /// Piers on piles where lines of them stand in water; others are painted.
  std::int64_t add_piers(std::vector<Way>& piers, double half_size_m, std::vector<Deck>& decks) {
    const RoadNetwork network(std::move(piers), half_size_m);
    std::vector<std::vector<std::pair<double, double>>> built(network.lines().size());
    std::int64_t num = 0;
    for (std::size_t l = 0; l < network.lines().size(); ++l) {
      const Line& line = network.lines()[l];
      double water_m = -1e300;
      for (const Line::Point& point : line.points) {
        const RoadGround ground = ground_at(point.at_world);
        if (ground.is_water) water_m = std::max(water_m, ground.level_m);
      }
      if (water_m < -1e200 || line.length_m() < 3.0) continue;
      built[l] = {{-1.0, line.length_m() + 1.0}};
      Deck deck;
      deck.feature = network.ways()[line.spans.front().way].feature;
      deck.style = network.style(line.spans.front());
      deck.thickness_m = 0.5;
      deck.parapet_m = 0.0;
      deck.span_m = 7.0;
      deck.has_abutments = false;
      for (const Line::Point& point : line.points)
        if (deck.points.empty() || point.along_m - deck.points.back().along_m > 0.5)
          deck.points.push_back(
              {point.at_world, point.tangent, point.along_m, water_m + kPierAbove_m});
      if (deck.points.size() < 2) continue;
      for (std::size_t p = 1; p < deck.points.size(); ++p)
        held_.add_line(deck.points[p - 1].at_world, deck.points[p].at_world,
                       deck.style.half_width_m);
      const Vector2d& first = line.points.front().at_world;
      const auto place = static_cast<std::uint64_t>(std::llround(1e3 * first.x()) * 1000003 +
                                                    std::llround(1e3 * first.y()));
      deck.key = core::stream_of(core::stream_of(deck.feature, 0x70696572ULL), place);
      decks.push_back(std::move(deck));
      ++num;
    }
    paint_.add_network(network, built);
    return num;
  }

  /// Builds those that stand in water; returns all other areas.
  std::vector<PaintedArea> add_area_piers(const std::vector<PaintedArea>& areas,
                                          const LayerInputs& inputs, std::int64_t& num,
                                          std::int64_t& num_bad) {
    std::vector<PaintedArea> others;
    std::vector<std::uint64_t> keys;
    std::vector<world::Solid> solids;
    for (const PaintedArea& area : areas) {
      double water_m = -1e300;
      Vector2d at_water = Vector2d::Zero();
      if (area.style.use == PadUse::Pier)
        for (const Vector2d& at : area.rings_world.front()) {
          const RoadGround ground = ground_at(at);
          if (!ground.is_water || ground.level_m <= water_m) continue;
          water_m = ground.level_m;
          at_water = at;
        }
      if (water_m < -1e200) {
        others.push_back(area);
        continue;
      }
      const double z = z_of(at_water, water_m);
      auto solid = build_area_pier(area.rings_world.front(), z - kPierBelow_m, z + kPierAbove_m,
                                   area.style.paving == world::Paving::Gravel);
      if (!solid) {
        ++num_bad;
        continue;
      }
      ++num;
      solid->provenance.feature = area.feature;
      const Vector2d& first = area.rings_world.front().front();
      keys.push_back(core::stream_of(
          area.feature, static_cast<std::uint64_t>(std::llround(1e3 * first.x()) * 1000003 +
                                                   std::llround(1e3 * first.y()))));
      solids.push_back(std::move(*solid));
      held_.add_area(area.rings_world);
    }
    const std::vector<std::uint32_t> ids = inputs.ids.assign("piers", keys);
    for (std::size_t k = 0; k < solids.size(); ++k) keep(std::move(solids[k]), ids[k]);
    return others;
  }

  void keep(world::Solid solid, std::uint32_t id) {
    Built built{.solid = std::move(solid),
                .lowest = Vector2d::Constant(1e300),
                .highest = Vector2d::Constant(-1e300)};
    built.solid.provenance.instance_id = id;
    for (const auto& level : built.solid.levels)
      for (const Eigen::Vector3i& vertex : level.shape.vertices_steps) {
        const Vector2d at =
            (built.solid.origin_steps + vertex).head<2>().cast<double>() * world::kHeightStep_m;
        built.lowest = built.lowest.cwiseMin(at);
        built.highest = built.highest.cwiseMax(at);
      }
    built_.push_back(std::move(built));
  }

  void build_decks(const std::vector<Deck>& decks, const LayerInputs& inputs) {
    const DeckSite site{
        .frame = inputs.frame,
        .ground_level_m = [this](const Vector2d& at) { return finished_level_m(at); },
        .is_water = [this](const Vector2d& at) { return ground_at(at).is_water; },
        .is_taken = [this](const Vector2d& at,
                           double radius_m) { return bed_->is_on_way(at, radius_m); }};
    std::vector<world::Solid> solids(decks.size());
    core::parallel_for(static_cast<std::int64_t>(decks.size()), [&](std::int64_t i) {
      const auto k = static_cast<std::size_t>(i);
      solids[k] = build_deck(decks[k], site);
    });
    std::vector<std::uint64_t> keys;
    for (const Deck& deck : decks) keys.push_back(deck.key);
    const std::vector<std::uint32_t> ids = inputs.ids.assign("bridges", keys);
    for (std::size_t k = 0; k < decks.size(); ++k)
      if (!solids[k].levels.empty()) keep(std::move(solids[k]), ids[k]);
  }

  void hold(const RoadNetwork& paths, const std::vector<PaintedArea>& areas) {
    for (const Line& line : paths.lines())
      for (const Span& span : line.spans) {
        const WayStyle& style = paths.style(span);
        if (style.is_tunnel) continue;
        for (std::uint32_t p = span.first_point; p < span.last_point; ++p)
          held_.add_line(line.points[p].at_world, line.points[p + 1].at_world,
                         style.half_width_m + style.shoulder_m);
      }
    for (const PaintedArea& area : areas) held_.add_area(area.rings_world);
  }

  const WorldSurface& surface_;
  double half_size_m_;
  std::vector<const Layer*> earlier_;
  std::string hash_;
  world::LayerInfo info_;
  std::optional<RoadBed> bed_;
  RoadPaint paint_;
  world::WayNetwork ways_;
  std::vector<Built> built_;
  HeldPlaces airfields_;
  HeldPlaces held_;
};

class Roads final : public LayerKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    source_.describe(visit);
    visit.key("sidewalks", options_.sidewalks,
              "streets: beside the streets of towns, and where features say so. tagged: only where "
              "they do. none: nowhere.",
              core::one_of({"streets", "tagged", "none"}));
    visit.key("paths", options_.has_paths, "Whether tracks, footways and cycleways are drawn.");
    visit.key("bridges", options_.has_bridges,
              "Whether bridges are built; otherwise ways go on over the ground.");
  }
  void validate() const override { source_.validate(); }
  std::unique_ptr<LayerKind> clone() const override { return std::make_unique<Roads>(*this); }
  std::unique_ptr<Layer> make(const LayerInputs& inputs) const override {
    return std::make_unique<RoadsLayer>(source_, options_, inputs);
  }

 private:
  FeatureSourceOptions source_;
  RoadsOptions options_;
};

}  // namespace

LayerKindInfo roads_layer() {
  return {"roads",
          "Roads, paths, railways, airfields, places, bridges and piers, cut into the ground.",
          [] { return std::unique_ptr<LayerKind>(std::make_unique<Roads>()); }};
}

}  // namespace terracast::tiler
