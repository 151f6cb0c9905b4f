#include "tiler/country/country_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tiler/country/airport.h"
#include "tiler/country/blocks.h"
#include "tiler/country/coast.h"
#include "tiler/country/countryside.h"
#include "tiler/country/dead_ends.h"
#include "tiler/country/lots.h"
#include "tiler/country/power.h"
#include "tiler/country/rivers.h"
#include "tiler/country/road_network.h"
#include "tiler/country/town_streets.h"
#include "tiler/country/trunk_lines.h"
#include "tiler/surface.h"

namespace terracast::tiler::country {
namespace {

BuildingManner manner_of(const PlanGround& ground, double lat_deg) {
  double sum = 0.0, land = 0.0;
  for (int j = 0; j < ground.side(); j += 8)
    for (int i = 0; i < ground.side(); i += 8)
      if (ground.is_sea()(i, j) == 0) {
        sum += ground.slope(ground.place(i, j));
        land += 1.0;
      }
  if (land > 0.0 && sum / land > 0.2 && std::abs(lat_deg) > 40.0) return BuildingManner::Alpine;
  return std::abs(lat_deg) < 44.5 ? BuildingManner::Southern : BuildingManner::Northern;
}

class Plan {
 public:
  Plan(const WorldSurface& surface, std::uint64_t seed, const SurveyedGround& surveyed,
       const core::Context& context, double lat_deg)
      : context_(context),
        seed_(seed),
        ground_(surface),
        occupancy_(ground_.half_size_m()),
        standing_(ground_.half_size_m()),
        builder_(ground_, occupancy_, survey_, manner_of(ground_, lat_deg), seed),
        barriers_(ground_.half_size_m()),
        water_barriers_(ground_.half_size_m()),
        rail_barriers_(ground_.half_size_m()),
        tunnels_(ground_.half_size_m()) {
    for (const PointsWorld& ring : surveyed.areas) occupancy_.add_ring(ring, kSurveyed);
    for (const PointsWorld& ring : surveyed.buildings) {
      occupancy_.add_ring(ring, kBuilding);
      standing_.add_ring(ring, kBuilding);
    }
    has_standing_ = !surveyed.buildings.empty();
  }

  std::vector<VectorFeature> make() {
    plan_water();
    settlements_ = choose_sites(ground_, occupancy_, seed_);
    airport_ = choose_airport(ground_, settlements_, occupancy_);
    if (airport_) build_airport(*airport_, builder_, ways_);
    port_ = choose_port(ground_, settlements_, occupancy_);
    if (port_) build_port(*port_, builder_);
    build_harbours(settlements_, builder_);
    plan_trunk_lines();
    plan_roads_and_streets();
    build_power(ground_, settlements_, builder_);
    build_stations(railway_, builder_);
    build_settlements(builder_, shapes_, find_blocks(ways_), seed_);
    build_farms(farms_, builder_);
    add_shore_features(settlements_, builder_);
    lay_fields(settlements_, builder_, seed_);
    write_roads();
    write_railway();
    for (const Settlement& settlement : settlements_) write_place(settlement);
    context_.log.info("country: {} settlements, {} ways, {} buildings, {} features",
                      settlements_.size(), ways_.size(), builder_.num_buildings(), survey_.size());
    return survey_.take();
  }

 private:
  void plan_water() {
    for (const PointsWorld& lake : find_lakes(ground_)) {
      // What is built over has not filled up.
      if (has_standing_ && !standing_.is_free(lake, 0.0)) continue;
      survey_.add_area(Theme::Water, lake, {{"natural", "water"}, {"water", "lake"}});
      occupancy_.add_ring(lake, kWater | kLake);
    }
    for (const River& river : find_rivers(ground_)) {
      const double half_width_m = 0.5 * river.width_m;
      add_spanned_line(
          survey_, Theme::Water, river.line, below_buildings({}, river.line, half_width_m),
          {{"waterway", river.is_stream ? "stream" : "river"}, {"width", text_of(river.width_m)}});
      occupancy_.add_line(river.line, half_width_m + (river.is_stream ? 2.0 : 6.0), kWater);
      water_barriers_.add(river.line, half_width_m + 8.0);
    }
  }

  void plan_roads_and_streets() {
    RouteGrid net(ground_, river_nodes(ground_));
    std::vector<Point> gates;
    if (airport_ && airport_->is_large) {
      // The net's nearest place to the gate, and a way from there.
      const Point outside = airport_->gate() + airport_->side * 90.0 * left_of(airport_->along);
      const Point node = net.place(net.node_at(outside));
      gates.push_back(node);
      Way way;
      way.kind = RoadKind::Secondary;
      way.line = {airport_->gate(), node};
      ways_.push_back(way);
    }
    if (port_) {
      const Point node = net.place(net.node_at(port_->gate));
      gates.push_back(node);
      for (PointsWorld& line : port_roads(*port_, node)) {
        Way way;
        way.kind = RoadKind::Service;
        way.line = std::move(line);
        ways_.push_back(std::move(way));
      }
    }
    RoadNetwork network = plan_roads(net, ground_, settlements_, gates, occupancy_, standing_);
    for (const PointsWorld& tunnel : network.tunnels) tunnels_.add(tunnel, 0.0);
    for (Way& way : network.ways) ways_.push_back(std::move(way));
    // Where no road could be led nobody lives.
    std::erase_if(settlements_, [&](const Settlement& settlement) {
      return settlement.rank != Rank::City && !net.is_in_net(net.node_at(settlement.center));
    });
    for (const Settlement& settlement : settlements_)
      shapes_.emplace_back(settlement, ground_, seed_);
    StreetGrowth growth(ground_, ways_, occupancy_);
    for (const TownShape& shape : shapes_) {
      if (shape.settlement().rank == Rank::Hamlet) continue;
      for (Way& street : growth.grow(shape, seed_)) ways_.push_back(std::move(street));
    }
    farms_ = plan_farms(ground_, shapes_, occupancy_, ways_, seed_);
    add_interchanges(motorway_, ways_, ground_, occupancy_);
    for (const Way& ramp : motorway_.ramps)
      occupancy_.add_line(ramp.line, ramp.half_width_m() + 1.0, kRoad);
    join_at_crossings(ways_, ground_.half_size_m());
    retreat_from_water(ways_, {[this](const PointsWorld& line) {
                                 return merged(spans_over_water(line), length_of(line));
                               },
                               [this](const Point& at) { return is_wet(at); }});
    drop_unreached(ways_);
    drop_without_track(ways_, farms_);
    for (const Way& way : ways_) occupancy_.add_line(way.line, way.half_width_m(), kRoad);
  }

  void plan_trunk_lines() {
    const Grid<std::uint8_t> rivers = river_nodes(ground_);
    motorway_ = plan_motorway(ground_, rivers, settlements_, occupancy_);
    for (const Alignment& middle : motorway_.middles) {
      occupancy_.add_line(middle.line, 18.0, kRail);
      barriers_.add(middle.line, 27.0);
    }
    railway_ = plan_railway(ground_, rivers, settlements_, occupancy_);
    for (const Alignment& line : railway_.lines) {
      occupancy_.add_line(line.line, 4.5, kRail);
      rail_barriers_.add(line.line, 11.0);
    }
  }

  bool is_wet(const Point& at) const {
    return !occupancy_.is_free(at, 0.0, kWater) ||
           (ground_.sea_distance_m(at) < 3.0 * ground_.spacing_m() && ground_.is_sea_at(at));
  }

  /// Stretches over the sea, lakes and rivers.
  std::vector<StructureSpan> spans_over_water(const PointsWorld& line) const {
    std::vector<StructureSpan> spans = water_barriers_.spans(line);
    double along_m = 0.0;
    for (std::size_t k = 1; k < line.size(); ++k) {
      const double length = (line[k] - line[k - 1]).norm();
      const Point middle = 0.5 * (line[k] + line[k - 1]);
      const bool is_near_sea = ground_.sea_distance_m(middle) < 3.0 * ground_.spacing_m();
      const bool is_over_sea =
          is_near_sea && (ground_.is_sea_at(middle) || ground_.is_sea_at(line[k]));
      if (is_over_sea || !occupancy_.is_free(middle, 0.0, kLake))
        spans.push_back({along_m - 22.0, along_m + length + 22.0, false});
      along_m += length;
    }
    return spans;
  }

  /// Stretches over water and other lines.
  std::vector<StructureSpan> spans_of(const PointsWorld& line, bool is_over_rails,
                                      bool is_over_motorways) const {
    std::vector<StructureSpan> spans = spans_over_water(line);
    if (is_over_motorways)
      for (const StructureSpan& span : barriers_.spans(line)) spans.push_back(span);
    if (is_over_rails)
      for (const StructureSpan& span : rail_barriers_.spans(line)) spans.push_back(span);
    return spans;
  }

  /// Spans of a line, with those where it leads below buildings that stood before it, as tunnels.
  std::vector<StructureSpan> below_buildings(std::vector<StructureSpan> spans,
                                             const PointsWorld& line, double half_width_m) const {
    constexpr double kStep_m = 4.0;
    constexpr double kBefore_m = 8.0;  // that it goes down before their walls
    constexpr double kBeside_m = 1.5;
    const double length_m = length_of(line);
    if (!has_standing_) return merged(std::move(spans), length_m);
    std::vector<StructureSpan> below;
    const int num_steps = std::max(static_cast<int>(std::ceil(length_m / kStep_m)), 1);
    Point from = line.front();
    for (int k = 1; k <= num_steps; ++k) {
      const double to_m = length_m * k / num_steps;
      const Point to = k == num_steps ? line.back() : station_at(line, to_m).at;
      if (!standing_.is_free(from, to, half_width_m + kBeside_m))
        below.push_back({to_m - length_m / num_steps - kBefore_m, to_m + kBefore_m, true});
      from = to;
    }
    below = merged(std::move(below), length_m);
    spans.insert(spans.end(), below.begin(), below.end());
    spans = merged(std::move(spans), length_m);
    // A bridge does not lead into a house, either.
    for (StructureSpan& span : spans)
      for (const StructureSpan& hidden : below)
        span.is_tunnel = span.is_tunnel || (hidden.from_m < span.to_m && hidden.to_m > span.from_m);
    return spans;
  }

  void write_roads() {
    const auto write = [&](const Way& way, Tags more,
                           const std::vector<std::pair<double, double>>* tunnels) {
      const RoadRule& rule = rule_of(way.kind);
      Tags tags{{"highway", std::string(rule.highway)},
                {"surface", std::string(rule.surface)},
                {"lanes", fmt::format("{}", rule.lanes)},
                {"width", text_of(rule.width_m)},
                {"maxspeed", fmt::format("{}", rule.max_speed)}};
      if (way.is_urban) {
        tags.emplace_back("lit", "yes");
        tags.emplace_back("sidewalk", "both");
      }
      for (auto& tag : more) tags.push_back(std::move(tag));
      std::vector<StructureSpan> spans =
          spans_of(way.line, way.kind <= RoadKind::Tertiary, way.kind > RoadKind::MotorwayLink);
      if (tunnels != nullptr) {
        for (const auto& [from_m, to_m] : *tunnels) spans.push_back({from_m, to_m, true});
      } else {
        // Tunnels are the long straight pieces of their line.
        double along_m = 0.0;
        for (std::size_t k = 1; k < way.line.size(); ++k) {
          const double piece_m = (way.line[k] - way.line[k - 1]).norm();
          if (piece_m > 200.0 && tunnels_.has_piece(way.line[k - 1], way.line[k]))
            spans.push_back({along_m, along_m + piece_m, true});
          along_m += piece_m;
        }
      }
      add_spanned_line(survey_, Theme::Road, way.line,
                       below_buildings(std::move(spans), way.line, way.half_width_m()), tags);
    };
    for (const Way& way : ways_) write(way, {}, nullptr);
    for (std::size_t k = 0; k < motorway_.carriageways.size(); ++k)
      write(motorway_.carriageways[k], {{"oneway", "yes"}, {"ref", "A 1"}},
            &motorway_.tunnels_m[k]);
    for (const Way& ramp : motorway_.ramps) write(ramp, {{"oneway", "yes"}}, nullptr);
  }

  void write_railway() {
    for (const Alignment& line : railway_.lines) {
      std::vector<StructureSpan> spans = spans_of(line.line, false, true);
      for (const auto& [from_m, to_m] : line.tunnels_m) spans.push_back({from_m, to_m, true});
      constexpr double kHalfTrack_m = 3.0;
      add_spanned_line(survey_, Theme::Rail, line.line,
                       below_buildings(std::move(spans), line.line, kHalfTrack_m),
                       {{"railway", "rail"},
                        {"gauge", "1435"},
                        {"tracks", "1"},
                        {"electrified", "no"},
                        {"usage", "main"}});
    }
  }

  void write_place(const Settlement& settlement) {
    constexpr const char* kNames[] = {"city", "town", "village", "hamlet"};
    survey_.add_point(Theme::Place, settlement.center,
                      {{"place", kNames[static_cast<int>(settlement.rank)]},
                       {"population", fmt::format("{:.0f}", settlement.population)}});
  }

  const core::Context& context_;
  std::uint64_t seed_;
  PlanGround ground_;
  Occupancy occupancy_;
  Occupancy standing_;  ///< buildings that were there before the country
  bool has_standing_ = false;
  Survey survey_;
  Builder builder_;
  Barriers barriers_;  ///< motorways
  Barriers water_barriers_;
  Barriers rail_barriers_;
  Barriers tunnels_;
  std::vector<Settlement> settlements_;
  std::optional<Airport> airport_;
  std::vector<Way> ways_;
  std::optional<Port> port_;
  Motorway motorway_;
  Railway railway_;
  std::vector<FarmSite> farms_;
  std::vector<TownShape> shapes_;
};

}  // namespace

std::vector<VectorFeature> make_country(const WorldSurface& surface, std::uint64_t seed,
                                        const SurveyedGround& surveyed,
                                        const core::Context& context) {
  Plan plan(surface, seed, surveyed, context, surface.options().origin_lat_deg);
  return plan.make();
}

}  // namespace terracast::tiler::country
