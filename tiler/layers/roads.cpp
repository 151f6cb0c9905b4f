#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>

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
#include "tiler/roads/held_places.h"
#include "tiler/roads/joined_decks.h"
#include "tiler/roads/pads.h"
#include "tiler/roads/road_bed.h"
#include "tiler/roads/road_features.h"
#include "tiler/roads/road_heights.h"
#include "tiler/roads/road_network.h"
#include "tiler/roads/road_paint.h"
#include "tiler/roads/road_tags.h"
#include "tiler/roads/water_gaps.h"
#include "tiler/roads/way_parts.h"
#include "tiler/surface.h"
#include "tiler/told_cover.h"

// Roads, paths, railways, airfields, places: a network with long profiles, earth works, paint and bridges.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::Cover;

/// Bumped when the same features make something else.
constexpr int kRoadsVersion = 15;
constexpr double kPierAbove_m = 1.3;
constexpr double kPierBelow_m = 8.0;

class RoadsLayer final : public Layer, public DryCover {
 public:
  RoadsLayer(const FeatureSourceOptions& source, const RoadsOptions& options,
             const LayerInputs& inputs)
      : surface_(inputs.surface), half_size_m_(0.5 * inputs.size_m) {
    for (const auto& layer : inputs.earlier) {
      earlier_.push_back(layer.get());
      earlier_covers_.add(*layer);
    }
    FeatureSet set =
        read_features(source, {.points = true, .lines = true, .areas = true, .wanted = is_of_roads},
                      inputs, road_tag_table());
    hash_ = core::content_hash(fmt::format("roads {} {} {} {} {} {}", kRoadsVersion, inputs.seed,
                                           set.content_hash, options.sidewalks, options.has_paths,
                                           options.has_bridges));
    info_.source = set.name;
    info_.content_hash = set.content_hash;
    info_.counts = set.counts;
    info_.ledger = set.ledger;

    const double half_size_m = half_size_m_;
    RoadFeatures sorted = sort_features(set.features, options, half_size_m);
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
    std::int64_t num_crowded = 0;
    const std::int64_t num_piers = add_piers(sorted.piers, half_size_m, decks, num_crowded);
    const std::int64_t num_tangled = build_decks(decks, inputs);
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
    if (sorted.num_not_built > 0)
      put("lines and areas of kinds that are not built", sorted.num_not_built);
    sorted.hidden.append_to(info_.counts);
    num_crowded += counts.num_crowded + more.num_crowded;
    if (num_crowded > 0) put("ways left out where too many lie", num_crowded);
    if (num_tangled > 0)
      put("pairs of bridges too tangled to tell where they lie on each other", num_tangled);
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
    if (!shaped.is_way && earlier_covers_.is_water(place_world, ground)) return 0.0;
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

  RoadGround ground_at(const Vector2d& place_world) const {
    const SurfaceSample sample = surface_.sample(place_world.x(), place_world.y());
    if (sample.cover == Cover::Sea) return {level_of(place_world, sample.z_world), true};
    double z = sample.z_world;
    for (const Layer* layer : earlier_) z += layer->lift_m(place_world, sample);
    return {level_of(place_world, z), earlier_covers_.is_water(place_world, sample)};
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
  std::int64_t add_piers(std::vector<Way>& piers, double half_size_m, std::vector<Deck>& decks,
                         std::int64_t& num_crowded) {
    const RoadNetwork network(std::move(piers), half_size_m);
    num_crowded = network.counts().num_crowded;
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

  /// returns   JoinedDecks::num_tangled()
  std::int64_t build_decks(const std::vector<Deck>& decks, const LayerInputs& inputs) {
    const DeckSite site{
        .frame = inputs.frame,
        .ground_level_m = [this](const Vector2d& at) { return finished_level_m(at); },
        .is_water = [this](const Vector2d& at) { return ground_at(at).is_water; },
        .is_taken = [this](const Vector2d& at,
                           double radius_m) { return bed_->is_on_way(at, radius_m); }};
    const JoinedDecks joined(decks);
    std::vector<world::Solid> solids(decks.size());
    core::parallel_for(static_cast<std::int64_t>(decks.size()), [&](std::int64_t i) {
      const auto k = static_cast<std::size_t>(i);
      DeckSite own = site;
      own.is_without_marks = [&](const Vector2d& at, double level_m) {
        return joined.is_without_marks(k, at, level_m);
      };
      solids[k] = build_deck(joined.lowered(k), own);
    });
    std::vector<std::uint64_t> keys;
    for (const Deck& deck : decks) keys.push_back(deck.key);
    const std::vector<std::uint32_t> ids = inputs.ids.assign("bridges", keys);
    for (std::size_t k = 0; k < decks.size(); ++k)
      if (!solids[k].levels.empty()) keep(std::move(solids[k]), ids[k]);
    return joined.num_tangled();
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
  ToldCovers earlier_covers_;
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
